r"""Half-spaces of the noise that cover all crashes of a profile.

At an instant, a displacement that overlaps lies in K, and K lies in every half-space made of its
faces with weights u >= 0:

    delta in K  implies  a . delta <= b,   a = sum_f u_f normal_f,  b = sum_f u_f offset_f.

The one that is least likely under delta ~ N(nominal, Sigma) touches K in its point nearest to
the nominal displacement in the metric of Sigma: where a crash is most likely.  A face, then, or
between faces at a corner.  Least-distance programming finds u (Lawson & Hanson, Solving Least
Squares Problems, ch. 23).

A step from t-1 to t is covered by two half-spaces with the same a and b: if both ends had
a . delta > b, so would all points between them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.dynamics import square_root
from ppg_env.risk.crash_events import CrashModel

SLACK = 1e-9
"""Length by which half-spaces are moved outwards: rounding must not leave a crash uncovered."""


PROBES = np.linspace(0.0, 1.0, 17)
"""Where in a step half-spaces are sought for it; the best is taken."""


@dataclass(frozen=True, eq=False)
class HalfSpaces:
    """C events  normal . (e_a - e_b)(t) <= offset  of the deviations; see :mod:`streams`.

    Attributes
    ----------
    encounter, times : (C,) whose and when.
    parties : (C, 2) the processes a and b; b = -1 for none.
    normals, offsets : (C, d) unit normals and (C,) offsets, infinite for an event that is sure.
    deviations : (C,) standard deviation of the left side; 1 for an event that is sure.
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
    """Half-spaces of positive probability that contain every crash of ``model``."""
    found = [h for h in _cover(model) if h.tail > 0]
    d, n = model.processes.dim, model.processes.loops.shape[1]
    covariances = model.processes.covariances(model.steps)
    responses = [_responses(model, covariances, h) for h in found]
    encounter = np.array([h.encounter for h in found], dtype=np.int64)
    return HalfSpaces(
        encounter=encounter,
        times=np.array([h.time for h in found], dtype=np.int64),
        parties=model.processes.parties[encounter],
        normals=np.array([h.normal for h in found]).reshape(-1, d),
        offsets=np.array([h.offset for h in found]),
        deviations=np.array([h.deviation for h in found]),
        tails=np.array([h.tail for h in found]),
        responses=np.array(responses).reshape(len(found), model.steps + 1, 2, n),
    )


@dataclass(frozen=True, eq=False)
class _HalfSpace:
    encounter: int
    time: int
    normal: np.ndarray
    offset: float
    deviation: float
    tail: float


def _cover(model: CrashModel) -> Iterator[_HalfSpace]:
    covariances, d = model.processes.covariances(model.steps), model.processes.dim
    for e, parties in enumerate(model.processes.parties):
        total = covariances[:, parties[parties >= 0], :d, :d].sum(axis=1)
        normals, depths = model.faces(e)
        rooms = depths - model.nominal[e] @ normals.T  # (H+1, F), for deviations
        last = min(int(model.until[e]), model.game.horizon + 1)
        if not model.swept:
            for t in range(last):
                weights = _nearest(normals, rooms[t], total[t])
                yield _half_space(e, t, weights, normals, rooms[t], total[t])
            continue
        for t in range(1, min(last, model.game.horizon) + 1):
            ends = (t - 1, t)
            between = [
                _nearest(normals, *((1 - s) * x[t - 1] + s * x[t] for x in (rooms, total)))
                for s in PROBES
            ]
            pairs = [
                [_half_space(e, k, mix, normals, rooms[k], total[k]) for k in ends]
                for mix in (*np.eye(len(normals)), *between)
            ]
            yield from min(pairs, key=lambda pair: sum(h.tail for h in pair))


def _nearest(normals: np.ndarray, room: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(F,) weights u of the least likely half-space; zero where the nominal point is inside."""
    from scipy.optimize import nnls

    program = np.vstack([-(normals @ square_root(covariance)).T, -room])
    weights, _ = nnls(program, np.append(np.zeros(len(covariance)), 1.0))
    return weights


def _half_space(
    encounter: int,
    time: int,
    weights: np.ndarray,
    normals: np.ndarray,
    room: np.ndarray,
    covariance: np.ndarray,
) -> _HalfSpace:
    from scipy.special import ndtr

    normal = weights @ normals
    length = float(np.linalg.norm(normal))
    if length <= tol.FLAT * weights.sum() or not length:
        return _HalfSpace(encounter, time, np.zeros_like(normal), np.inf, 1.0, 1.0)
    normal, offset = normal / length, float(weights @ room) / length + SLACK
    deviation = float(np.sqrt(max(normal @ covariance @ normal, 0.0)))
    if deviation > tol.DEVIATION:
        return _HalfSpace(
            encounter, time, normal, offset, deviation, float(ndtr(offset / deviation))
        )
    sure = offset >= 0
    return _HalfSpace(encounter, time, 0 * normal, np.inf, 1.0, float(sure))


def _responses(model: CrashModel, covariances: np.ndarray, half: _HalfSpace) -> np.ndarray:
    """(T+1, 2, n) covariances of both processes with the half-space's standard normal."""
    T, (_, n, _) = model.steps, model.processes.loops.shape
    result, direction = np.zeros((T + 1, 2, n)), np.zeros(n)
    direction[: half.normal.size] = half.normal / half.deviation
    for side, s in enumerate(model.processes.parties[half.encounter]):
        if s < 0:
            continue
        loop, sign = model.processes.loops[s], (1.0, -1.0)[side]
        ahead = direction
        for t in range(half.time, -1, -1):  # Cov(e_t, e_time) = Sigma_t (F^(time - t))'
            result[t, side] = sign * covariances[t, s] @ ahead
            ahead = loop.T @ ahead
        for t in range(half.time, T):
            result[t + 1, side] = loop @ result[t, side]
    return result
