"""Crash events of simulated episodes: a profile's mean displacements plus random deviations.

The event is the game's own.  With ``collisions="instants"``, two bodies in traffic overlap at a
time step; with ``"swept"``, during a step that begins in traffic, both moving on straight lines
from instant to instant, ends included.  With ``on_goal="stay"`` a parked body keeps the deviation
that it had at its arrival.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ppg_env.game.canonical import in_own_units
from ppg_env.game.game import Game
from ppg_env.game.margins import (
    collision_faces,
    ends_of_traffic,
    mean_displacements,
    membership,
)
from ppg_env.game.plan import Profile
from ppg_env.risk import kernel
from ppg_env.risk.error_process import ErrorProcesses, error_processes


@dataclass(frozen=True, eq=False)
class OverlapRecord:
    """Overlaps in a block of episodes; N agents, E encounters, times 0..H, B episodes.

    Attributes
    ----------
    times : (E, H+1) episodes in which each encounter overlapped at each time.
    first_times : (E, H+1) those in which it did for the first time.
    first_any : (H+1,) episodes whose first overlap of any encounter was at each time.
    met : (E, B) whether the encounter overlapped at any time.
    crashed : (N, B) whether the agent did.
    """

    times: np.ndarray
    first_times: np.ndarray
    first_any: np.ndarray
    met: np.ndarray
    crashed: np.ndarray


@dataclass(frozen=True, eq=False)
class CrashModel:
    """A profile of ``game`` on its schedule, as arrays for the compiled loops.

    Attributes
    ----------
    processes : the deviations from the means.
    until : (E,) first time at which each encounter is out of traffic; swept, its first such step.
    nominal : (E, H+1, d) mean displacements.
    normals, depths : faces of all collision sets, those of encounter e from ``first_face[e]`` on;
        depths are offsets less the tolerance within which bodies only touch.
    swept : whether overlaps count during steps, on straight lines from instant to instant, or at
        instants only.
    """

    game: Game
    processes: ErrorProcesses
    until: np.ndarray
    nominal: np.ndarray
    normals: np.ndarray
    depths: np.ndarray
    first_face: np.ndarray
    swept: bool

    @property
    def steps(self) -> int:
        """Steps of noise that matter: to the last instant, or to the end of the last step."""
        return min(int(self.until.max(initial=1)) - 1 + self.swept, self.game.horizon)

    def faces(self, encounter: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the normals and depths of one collision set."""
        rows = slice(*self.first_face[encounter : encounter + 2])
        return self.normals[rows], self.depths[rows]

    def watch(self, errors: np.ndarray, episodes: int) -> OverlapRecord:
        """Find the overlaps in the first ``episodes`` of a block of deviations."""
        shape, B = (len(self.until), self.game.horizon + 1), errors.shape[-1]
        times, first_times = (np.zeros(shape, dtype=np.int64) for _ in range(2))
        first_any, met = np.zeros(shape[1], dtype=np.int64), np.zeros((shape[0], B), dtype=np.bool_)
        kernel.overlaps(
            errors, episodes, self.processes.parties, self.until, self.normals, self.depths,
            self.first_face, self.nominal, self.swept, times, first_times, first_any, met,
        )  # fmt: skip
        crashed = np.array([met[own].any(axis=0) for own in membership(self.game)])
        return OverlapRecord(times, first_times, first_any, met, crashed)


def make_crash_model(
    game: Game, profile: Profile, *, swept: bool | None = None, merge: bool = True
) -> CrashModel:
    """Return the crash model of ``profile``.

    Parameters
    ----------
    swept
        Whether overlaps count during steps, or at instants only; by default as ``game`` says.
    merge
        Whether to simulate two agents as one where possible (:mod:`ppg_env.risk.error_process`).
    """
    game, profile = in_own_units(game, profile)
    swept = is_swept(game) if swept is None else swept
    watched = game
    if swept != is_swept(game):
        watched = replace(game, collisions="swept" if swept else "instants")
    arrival, faces = [plan.arrival for plan in profile], collision_faces(game)
    return CrashModel(
        game=game,
        processes=error_processes(game, arrival, merge=merge),
        until=ends_of_traffic(watched, arrival),
        nominal=mean_displacements(game, profile),
        normals=faces.normals,
        depths=faces.depths,
        first_face=faces.first,
        swept=swept,
    )


def is_swept(game: Game) -> bool:
    """Return whether bodies must keep apart during the steps too."""
    return game.collisions == "swept"
