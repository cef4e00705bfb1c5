r"""Probabilities of crashes in one step of Gaussian noise, exact and vectorised.

With D the displacement of two bodies, K their collision set and N(mean, S) the law of D at the end
of the step, these are

    overlap   Pr(D in K),
    swept     Pr(the segment from D before to D after meets K).

A box with independent components is a product of intervals.  Other sets in the plane are integrals
over edges (:mod:`solvers.feedback.events.planar_events`), in space those of
:mod:`ppg_env.risk.polytope_probability`.  In directions without noise the displacement is certain.
As in the environment, bodies that overlap by less than a tolerance only touch: K is K less a rim of
that width (in space only where the displacement is certain).  Absolute errors are below 1e-12.
"""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.game.polytope import Polytope
from ppg_env.risk.overlap import FLAT, UNCORRELATED, is_box, log_overlap
from solvers.feedback.events import planar_events as planar

FARTHEST = 1e5
"""In space, what a set hides is cut off at this multiple of the distance from the start."""


def overlap_probability(
    collision: Polytope, mean: np.ndarray, covariance: np.ndarray, touch: float = tol.LENGTH
) -> np.ndarray:
    """Return (...) Pr(mean + N(0, covariance) deeper in ``collision`` than a touch).

    Parameters
    ----------
    collision
        The set K, in d dimensions.
    mean
        (..., d) means of the displacement.
    covariance
        (d, d) covariance, which may be singular.
    touch
        Depth within which bodies only touch; ``tol.LENGTH`` times the game's unit.

    Raises
    ------
    InputError
        In more than three dimensions, unless K is a box and the covariance is diagonal.
    """
    mean, covariance = np.asarray(mean, dtype=float), np.asarray(covariance, dtype=float)
    points = np.ascontiguousarray(mean.reshape(-1, collision.dim))
    result = np.zeros(len(points))
    deviation = np.sqrt(np.diagonal(covariance).clip(0.0))
    if is_box(collision.normals) and _independent(covariance, deviation):
        low, high = collision.bounds
        deviation = np.where(deviation > tol.DEVIATION, deviation, 0.0)
        planar.box_probability(low + touch, high - touch, points, deviation, result)
    elif collision.dim == 2:
        corners = _corners(collision, touch)
        if corners is not None:
            _planar(corners, None, points, covariance, result)
    else:
        result[:] = _log_overlap(collision, points, covariance)
    return result.reshape(mean.shape[:-1])


def swept_probability(
    collision: Polytope,
    before: np.ndarray,
    mean: np.ndarray,
    covariance: np.ndarray,
    touch: float = tol.LENGTH,
) -> np.ndarray:
    """Return (...) Pr(the segment from ``before`` to mean + N(0, covariance) meets ``collision``).

    It is 1 where ``before`` is inside.  ``before`` and ``mean`` (..., d) are broadcast against each
    other.  In three dimensions every different row of ``before`` costs a convex hull.

    Parameters are those of :func:`overlap_probability`.

    Raises
    ------
    InputError
        In more than three dimensions.
    """
    d = collision.dim
    require(d <= 3, "shape", f"has dimension {d}", "swept collisions need at most 3")
    covariance = np.asarray(covariance, dtype=float)
    before, mean = np.broadcast_arrays(np.asarray(before, float), np.asarray(mean, float))
    starts = np.ascontiguousarray(before.reshape(-1, d))
    points = np.ascontiguousarray(mean.reshape(-1, d))
    result = np.zeros(len(points))
    if d == 1:
        result[:] = _swept_interval(collision, starts[:, 0], points[:, 0], covariance, touch)
    elif d == 2:
        corners = _corners(collision, touch)
        if corners is not None:
            _planar(corners, starts, points, covariance, result)
    else:
        _swept_in_space(collision, starts, points, covariance, touch, result)
    return result.reshape(mean.shape[:-1])


def _independent(covariance: np.ndarray, deviation: np.ndarray) -> bool:
    scale = UNCORRELATED * np.outer(deviation, deviation)
    return bool((np.abs(covariance) * (1 - np.eye(len(deviation))) <= scale).all())


def _corners(collision: Polytope, touch: float) -> np.ndarray | None:
    """Return the corners (V, 2) of the set of displacements deeper than a touch, None if empty."""
    if is_box(collision.normals):
        low, high = collision.bounds[0] + touch, collision.bounds[1] - touch
        if not (low < high).all():
            return None
        return np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    try:
        inner = Polytope.from_halfspaces(collision.normals, collision.offsets - touch)
    except InputError:
        return None
    return np.ascontiguousarray(inner.vertices)


def _planar(
    corners: np.ndarray,
    starts: np.ndarray | None,
    points: np.ndarray,
    covariance: np.ndarray,
    result: np.ndarray,
) -> None:
    """Write the probabilities in the plane: swept ones if there are ``starts``."""
    values, vectors = np.linalg.eigh(covariance)
    spread = np.sqrt(values.clip(0.0))
    noisy = spread > max(FLAT * spread[-1], tol.DEVIATION)
    if not noisy.all():
        root = vectors[:, -1] * (spread[-1] if noisy[-1] else 0.0)
        swept = starts is not None
        planar.chord_probability(
            corners, swept, starts if starts is not None else points, points, root, result
        )
        return
    white = np.linalg.inv(np.linalg.cholesky(covariance)).T  # keeps the orientation
    if starts is None:
        planar.polygon_probability(corners @ white, points @ white, result)
    else:
        planar.shadow_probability(corners @ white, starts @ white, points @ white, result)


def _swept_interval(
    collision: Polytope,
    starts: np.ndarray,
    points: np.ndarray,
    covariance: np.ndarray,
    touch: float,
) -> np.ndarray:
    """Return (B,) the probabilities on a line: those of reaching the near end of the interval."""
    from scipy.special import ndtr

    low, high = collision.bounds[0][0] + touch, collision.bounds[1][0] - touch
    if low >= high:
        return np.zeros(len(points))
    depth = np.where(starts <= low, points - low, high - points)
    deviation = float(np.sqrt(max(covariance[0, 0], 0.0)))
    reached = (
        ndtr(depth / deviation) if deviation > tol.DEVIATION else (depth > 0).astype(np.float64)
    )
    return np.where((starts > low) & (starts < high), 1.0, reached)


def _swept_in_space(
    collision: Polytope,
    starts: np.ndarray,
    points: np.ndarray,
    covariance: np.ndarray,
    touch: float,
    result: np.ndarray,
) -> None:
    """Write the probabilities in space: each start has the hull of K and of what K hides."""
    for start in np.unique(starts, axis=0):
        chosen = (starts == start).all(axis=1)
        if collision.clearance(start) < -touch:
            result[chosen] = 1.0
            continue
        hidden = start + FARTHEST * (collision.vertices - start)
        cone = Polytope("vertices", (np.vstack([collision.vertices, hidden]),))
        result[chosen] = _log_overlap(cone, points[chosen], covariance)


def _log_overlap(collision: Polytope, points: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    covariances = np.broadcast_to(covariance, (len(points), *covariance.shape))
    return np.exp(log_overlap(collision, points, covariances))
