r"""Half-spaces of the noise that cover all crashes of a profile.

At an instant, a displacement that overlaps lies in K, and K lies in its supporting half-spaces
(:mod:`ppg_env.game.supporting_halfspaces`); the least likely one covers the instant.

A step from t-1 to t is covered by two half-spaces with the same a and b: if both ends had
a . delta > b, so had all points between them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.supporting_halfspaces import PROBES, nearest_weights
from ppg_env.risk.crash_events import CrashModel

SLACK = 1e-9
"""Length by which half-spaces are moved outwards: rounding must not leave a crash uncovered."""


@dataclass(frozen=True, eq=False)
class HalfSpaces:
    """C events  normal . (e_a - e_b)(t) <= offset  of the deviations.

    The processes e are those of :mod:`ppg_env.risk.error_process`.

    Attributes
    ----------
    encounter, times : (C,) encounter and time of each event.
    parties : (C, 2) the processes a and b; b = -1 for none.
    normals, offsets : (C, d) unit normals and (C,) offsets; infinite for a certain event.
    deviations : (C,) standard deviation of the left side; 1 for a certain event.
    tails : (C,) probability of each.
    responses : (C, T+1, 2, n) covariances of e_a and e_b at all times with the left side over its
        deviation.
    """

    encounter: np.ndarray
    times: np.ndarray
    parties: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    deviations: np.ndarray
    tails: np.ndarray
    responses: np.ndarray


def cover(model: CrashModel) -> HalfSpaces:
    """Return half-spaces of positive probability that cover every crash of ``model``."""
    halves = [h for h in each_half_space(model) if h.tail > 0]
    d, n = model.processes.dim, model.processes.loops.shape[1]
    covariances = model.processes.covariances(model.steps)
    paths = [responses(model, covariances, h) for h in halves]
    encounter = np.array([h.encounter for h in halves], dtype=np.int64)
    return HalfSpaces(
        encounter=encounter,
        times=np.array([h.time for h in halves], dtype=np.int64),
        parties=model.processes.parties[encounter],
        normals=np.array([h.normal for h in halves]).reshape(-1, d),
        offsets=np.array([h.offset for h in halves]),
        deviations=np.array([h.deviation for h in halves]),
        tails=np.array([h.tail for h in halves]),
        responses=np.array(paths).reshape(len(halves), model.steps + 1, 2, n),
    )


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """One of these events; see :class:`HalfSpaces`."""

    encounter: int
    time: int
    normal: np.ndarray
    offset: float
    deviation: float
    tail: float

    @property
    def level(self) -> float:
        """Distance of the mean in standard deviations; infinite for certain and void events."""
        if np.isinf(self.offset):
            return -np.inf if self.tail else np.inf
        return -self.offset / self.deviation


def each_half_space(model: CrashModel) -> Iterator[HalfSpace]:
    """Yield the half-spaces, those without probability too: one per instant, two per step."""
    covariances, d = model.processes.covariances(model.steps), model.processes.dim
    for e, parties in enumerate(model.processes.parties):
        total = covariances[:, parties[parties >= 0], :d, :d].sum(axis=1)
        normals, depths = model.faces(e)
        rooms = depths - model.nominal[e] @ normals.T  # (H+1, F), offsets for deviations
        last = min(int(model.until[e]), model.game.horizon + 1)
        if not model.swept:
            for t in range(last):
                weights = nearest_weights(normals, rooms[t], total[t])
                yield half_space(e, t, weights, normals, rooms[t], total[t])
            continue
        for t in range(1, min(last, model.game.horizon) + 1):
            ends = (t - 1, t)
            between = [
                nearest_weights(normals, *((1 - s) * x[t - 1] + s * x[t] for x in (rooms, total)))
                for s in PROBES
            ]
            pairs = [
                [half_space(e, k, mix, normals, rooms[k], total[k]) for k in ends]
                for mix in (*np.eye(len(normals)), *between)
            ]
            yield from min(pairs, key=lambda pair: sum(h.tail for h in pair))


def half_space(
    encounter: int,
    time: int,
    weights: np.ndarray,
    normals: np.ndarray,
    room: np.ndarray,
    covariance: np.ndarray,
) -> HalfSpace:
    """Return the half-space of faces with ``weights``, whose room at the mean is ``room``."""
    from scipy.special import ndtr

    normal = weights @ normals
    length = float(np.linalg.norm(normal))
    if length <= tol.FLAT * weights.sum() or not length:
        return HalfSpace(encounter, time, np.zeros_like(normal), np.inf, 1.0, 1.0)
    normal, offset = normal / length, float(weights @ room) / length + SLACK
    deviation = float(np.sqrt(max(normal @ covariance @ normal, 0.0)))
    if deviation > tol.DEVIATION:
        return HalfSpace(
            encounter, time, normal, offset, deviation, float(ndtr(offset / deviation))
        )
    certain = offset >= 0
    return HalfSpace(encounter, time, 0 * normal, np.inf, 1.0, float(certain))


def responses(model: CrashModel, covariances: np.ndarray, half: HalfSpace) -> np.ndarray:
    """Return (T+1, 2, n) covariances of both processes with the half-space's standard normal."""
    T, (_, n, _) = model.steps, model.processes.loops.shape
    result, direction = np.zeros((T + 1, 2, n)), np.zeros(n)
    direction[: half.normal.size] = half.normal / half.deviation
    for side, s in enumerate(model.processes.parties[half.encounter]):
        if s < 0:
            continue
        loop, sign = model.processes.loops[s], (1.0, -1.0)[side]
        rest = min(int(model.processes.rests[s]), T)
        ahead, time = direction, min(half.time, rest)
        for t in range(time, -1, -1):  # Cov(e_t, e_time) = Sigma_t (F^(time - t))'
            result[t, side] = sign * covariances[t, s] @ ahead
            ahead = loop.T @ ahead
        for t in range(time, rest):
            result[t + 1, side] = loop @ result[t, side]
        result[rest + 1 :, side] = result[rest, side]
    return result
