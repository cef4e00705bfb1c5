r"""Proved lower bounds on the crash probability of a profile on its schedule.

The events are overlaps A_e(t) at the likeliest instants; with ``collisions="swept"`` also those at
shares of the likeliest steps, whose union is at most the overlap during the steps.  Each has an
exact probability.  A joint one is at most that of two half-spaces that contain the collision sets,
a bivariate normal: those that touch the sets in the design points, or the faces of a corner
(:mod:`ppg_env.risk.design_points`); events that share no body are independent.
:mod:`ppg_env.risk.dawson_bounds` bounds the union from below.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ppg_env.game.canonical import in_own_units
from ppg_env.game.game import Game
from ppg_env.game.margins import membership
from ppg_env.game.plan import Profile
from ppg_env.risk.crash_events import CrashModel, make_crash_model
from ppg_env.risk.dawson_bounds import log_joint_tails_above, log_union_bound
from ppg_env.risk.design_points import design_point, moment, paths_to, with_its_faces
from ppg_env.risk.overlap import log_overlap
from ppg_env.risk.union_bounds import RiskBounds

FAINT = np.log(1e-3)
"""Events below this share of the likeliest of a union are left out."""

MOST = 24
"""Largest number of events of a union."""

SHARES = (0.25, 0.5, 0.75)
"""Moments of a step that count where bodies must keep apart during steps."""


@dataclass(frozen=True)
class _Event:
    """Overlap of ``encounter`` at a moment, with its log probability."""

    encounter: int
    time: int
    share: float
    log: float


class _Half(NamedTuple):
    """Responses of a half-space, its normal over the deviation, and the level of the mean."""

    paths: np.ndarray
    normal: np.ndarray
    level: float


def lower_bounds(
    game: Game, profile: Profile, bounds: RiskBounds
) -> tuple[tuple[float, ...], float]:
    """Return lower bounds on the probability that each agent crashes, and that any does.

    None is below ``least`` of ``bounds``, those of the profile.
    """
    game, profile = in_own_units(game, profile)
    model = make_crash_model(game, profile, merge=False)
    unions = _Unions(model, bounds.log_instants)
    agents = tuple(unions.bound(own) for own in membership(game))
    return agents, unions.bound(np.ones(len(game.encounters), dtype=bool))


class _Unions:
    """Bounds on unions of overlaps, whose half-spaces are computed once."""

    def __init__(self, model: CrashModel, logs: np.ndarray) -> None:
        self._model, self._logs = model, logs
        self._covariances = model.processes.covariances(model.game.horizon)
        self._halves: dict[_Event, list[_Half]] = {}
        self._known: dict[int, list[_Event]] = {}

    def bound(self, chosen: np.ndarray) -> float:
        """Return a lower bound on the union of all overlaps of the ``chosen`` (E,) encounters."""
        events = self._events(np.flatnonzero(chosen))
        if not events or events[0].log >= 0.0:
            return float(bool(events))
        logs = np.array([event.log for event in events])
        if len(events) == 1:
            return float(np.exp(logs[0]))
        return float(np.exp(log_union_bound(logs, self._joint(events))))

    def _events(self, encounters: np.ndarray) -> list[_Event]:
        """Return the likeliest events, in descending order."""
        events = [event for e in encounters.tolist() for event in self._of(e)]
        events = sorted(events, key=lambda event: -event.log)[:MOST]
        return [event for event in events if event.log >= events[0].log + FAINT]

    def _of(self, encounter: int) -> list[_Event]:
        """Return the likeliest events of an encounter."""
        if encounter not in self._known:
            rows = [(1.0, self._logs[encounter])]
            if self._model.swept:
                rows += [(share, self._between(encounter, share)) for share in SHARES]
            events = [
                _Event(encounter, t, share, float(log))
                for share, logs in rows
                for t, log in enumerate(logs)
                if np.isfinite(log)
            ]
            self._known[encounter] = sorted(events, key=lambda event: -event.log)[:MOST]
        return self._known[encounter]

    def _between(self, encounter: int, share: float) -> np.ndarray:
        """Return (H+1,) logs of the overlap at a share of the step that ends at each time."""
        logs = np.full(self._logs.shape[1], -np.inf)
        last = min(int(self._model.until[encounter]), len(logs) - 1)
        if last:
            steps = range(1, last + 1)
            moments = [moment(self._model, self._covariances, encounter, t, share) for t in steps]
            means, spreads = (np.array(parts) for parts in zip(*moments, strict=True))
            collision = self._model.game.encounters[encounter].collision
            logs[1 : last + 1] = log_overlap(collision, means, spreads)
        return logs

    def _joint(self, events: list[_Event]) -> np.ndarray:
        """Return (K, K) upper bounds on the logs of the joint probabilities."""
        rows = [half for event in events for half in self._halves_of(event)]
        owners = [k for k, event in enumerate(events) for _ in self._halves_of(event)]
        first_rows = np.searchsorted(owners, np.arange(len(events)))
        levels = np.array([row.level for row in rows])
        rho = self._correlations(rows, [events[k] for k in owners])
        joint = log_joint_tails_above(rho, *np.broadcast_arrays(levels[:, None], levels))
        for axis in (0, 1):
            joint = np.minimum.reduceat(joint, first_rows, axis=axis)
        logs = np.array([event.log for event in events])
        parties = self._model.processes.parties[[event.encounter for event in events]]
        meet = (parties[:, None, :, None] == parties[None, :, None, :]) & (parties >= 0)[
            :, None, :, None
        ]
        joint = np.minimum(joint, np.minimum(logs[:, None], logs))
        return np.where(meet.any(axis=(2, 3)), joint, logs[:, None] + logs)

    def _correlations(self, rows: list[_Half], events: list[_Event]) -> np.ndarray:
        """Return (R, R) correlations of the half-spaces' standard normals."""
        parties = self._model.processes.parties[[event.encounter for event in events]]
        times = np.array([event.time for event in events])
        shares = np.array([event.share for event in events])[:, None, None]
        normals, d = np.array([row.normal for row in rows]), self._model.processes.dim
        rho = np.zeros((len(rows), len(rows)))
        for k, row in enumerate(rows):
            now, before = (row.paths[t, :, :d] for t in (times, np.maximum(times - 1, 0)))
            values = np.einsum("lsd,ld->ls", shares * now + (1 - shares) * before, normals)
            for side, sign in enumerate((1.0, -1.0)):
                same = (parties[:, side, None] == parties[k]) & (parties[k] >= 0)
                rho[k] += sign * (values * same).sum(axis=1)
        return np.clip(rho, -1.0, 1.0)

    def _halves_of(self, event: _Event) -> list[_Half]:
        """Return half-spaces that contain the collision set at the moment of an event."""
        if event not in self._halves:
            place = event.encounter, event.time, event.share
            point = design_point(self._model, self._covariances, *place)
            self._halves[event] = [
                _Half(
                    paths_to(self._model, self._covariances, option),
                    option.half.normal / option.half.deviation,
                    option.half.level,
                )
                for option in with_its_faces(self._model, self._covariances, point)
            ]
        return self._halves[event]
