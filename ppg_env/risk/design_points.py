r"""Design points of overlaps: the likeliest deviations of the displacement that cause them.

At an instant t, or at a share s of the step that ends at t, the displacement is normal,

    delta = (1 - s) delta(t-1) + s delta(t) ~ N(mean, Sigma),

and overlaps if it lies in the collision set K.  The point of K nearest to the mean in the metric of
Sigma is the design point; its distance is the reliability index beta, and Phi(-beta) the
probability of the half-space that touches K there: the first-order estimate (FORM).  K is a
polytope, so the point follows from a quadratic program, not from an iteration.

Source: Hasofer & Lind, Journal of the Engineering Mechanics Division 100 (1974); Rackwitz &
Fiessler, Computers & Structures 9 (1978).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ppg_env.game.supporting_halfspaces import PROBES, nearest_weights
from ppg_env.risk.covering_halfspaces import HalfSpace, each_half_space, half_space, responses
from ppg_env.risk.crash_events import CrashModel

ACTIVE = 1e-6
"""Share of a face in the half-space from which the design point lies on it."""


@dataclass(frozen=True, eq=False)
class DesignPoint:
    """The likeliest overlap of an encounter at one moment.

    Attributes
    ----------
    half : the half-space that touches K in the design point, at ``share`` of the step that ends at
        ``half.time``; 1 at an instant.
    faces : faces of K on which the point lies; none if the means overlap, or without noise.
    """

    half: HalfSpace
    share: float
    faces: tuple[int, ...]


def design_point(
    model: CrashModel, covariances: np.ndarray, encounter: int, time: int, share: float = 1.0
) -> DesignPoint:
    """Return the design point of ``encounter`` at ``share`` of the step that ends at ``time``.

    ``covariances`` are those of the processes of ``model``.
    """
    normals, depths = model.faces(encounter)
    mean, spread = moment(model, covariances, encounter, time, share)
    room = depths - normals @ mean
    weights = nearest_weights(normals, room, spread)
    half = half_space(encounter, time, weights, normals, room, spread)
    active = np.flatnonzero(weights > ACTIVE * weights.sum()) if np.isfinite(half.offset) else ()
    return DesignPoint(half, share, tuple(int(face) for face in active))


def with_its_faces(
    model: CrashModel, covariances: np.ndarray, point: DesignPoint
) -> list[DesignPoint]:
    """Return the point, and at a corner also the half-spaces of its faces in place of its own."""
    if len(point.faces) < 2:
        return [point]
    place = point.half.encounter, point.half.time
    normals, depths = model.faces(place[0])
    mean, spread = moment(model, covariances, *place, point.share)
    room, faces = depths - normals @ mean, np.eye(len(normals))
    halves = [half_space(*place, faces[f], normals, room, spread) for f in point.faces]
    return [point, *(replace(point, half=half) for half in halves)]


def moment(
    model: CrashModel, covariances: np.ndarray, encounter: int, time: int, share: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean and the covariance of the displacement at ``share`` of a step."""
    mean, spread = model.nominal[encounter, time], _covariance(model, covariances, encounter, time)
    if share < 1.0:
        earlier = _covariance(model, covariances, encounter, time - 1)
        cross = _covariance(model, covariances, encounter, time - 1, ahead=True)
        mixed = share * (1 - share) * (cross + cross.T)
        spread = (1 - share) ** 2 * earlier + share**2 * spread + mixed
        mean = (1 - share) * model.nominal[encounter, time - 1] + share * mean
    return mean, spread


def paths_to(model: CrashModel, covariances: np.ndarray, point: DesignPoint) -> np.ndarray:
    """Return (T+1, 2, n) covariances of both processes with the half-space's standard normal."""
    half = point.half
    ends = {half.time: point.share, half.time - 1: 1.0 - point.share}
    parts = [
        weight * responses(model, covariances, replace(half, time=time))
        for time, weight in ends.items()
        if weight
    ]
    return np.sum(parts, axis=0)


def likeliest_in_steps(model: CrashModel, covariances: np.ndarray) -> DesignPoint | None:
    """Return the design point with the smallest beta during all steps; None if there is none.

    If a half-space holds at neither end of a step, it does not hold in between, so that the smaller
    level of the two that cover a step bounds beta from below: other steps are skipped.
    """
    halves, best = list(each_half_space(model)), None
    steps = [(min(a.level, b.level), b) for a, b in zip(halves[::2], halves[1::2], strict=True)]
    for level, end in sorted(steps, key=lambda step: step[0]):
        if level >= (np.inf if best is None else best.half.level):
            break
        point = _likeliest_moment(model, covariances, end.encounter, end.time)
        if best is None or point.half.level < best.half.level:
            best = point
    return best


def _likeliest_moment(
    model: CrashModel, covariances: np.ndarray, encounter: int, time: int
) -> DesignPoint:
    from scipy.optimize import minimize_scalar

    def at(share: float) -> DesignPoint:
        if not share:  # the instant before
            return design_point(model, covariances, encounter, time - 1)
        return design_point(model, covariances, encounter, time, share)

    probes = [at(float(share)) for share in PROBES]
    k = int(np.argmin([probe.half.level for probe in probes]))
    if not np.isfinite(probes[k].half.level):
        return probes[k]
    ends = PROBES[max(k - 1, 0)], PROBES[min(k + 1, len(PROBES) - 1)]
    refined = minimize_scalar(lambda share: at(share).half.level, bounds=ends, method="bounded")
    return min(probes[k], at(float(refined.x)), key=lambda point: point.half.level)


def _covariance(
    model: CrashModel, covariances: np.ndarray, encounter: int, time: int, *, ahead: bool = False
) -> np.ndarray:
    """Return the covariance (d, d) of a displacement, or that with the next one (``ahead``)."""
    processes, total = model.processes, 0.0
    for s in processes.parties[encounter]:
        if s >= 0:
            moves = ahead and time < processes.rests[s]
            own = covariances[time, s]
            total = total + (own @ processes.loops[s].T if moves else own)
    d = processes.dim
    return np.asarray(total)[:d, :d]
