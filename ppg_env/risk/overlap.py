r"""Probability that a Gaussian displacement lies in a collision set.

    Pr(D in K),  D ~ N(mean, S),  K convex, in one, two or three dimensions

A box with a diagonal S is a product of intervals.  All other cases are whitened: with S = L L',
the point L^-1 (D - mean) is standard normal and the corners of K become L^-1 (v - mean).  In
directions without noise the displacement is certain: there, bodies that only touch do not overlap.

Results are logarithms, so that no probability underflows to zero.  Each is at most that of the best
face, log Phi(-(a_p mean - b_p) / sigma_p).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.special import log_ndtr

from ppg_env import tolerances as tol
from ppg_env.errors import require
from ppg_env.game.margins import face_margins
from ppg_env.game.polytope import Polytope
from ppg_env.risk.polytope_probability import log_interval, log_polygon, log_polyhedron

UNCORRELATED = 1e-13
"""A covariance with all correlations below this is treated as diagonal: at z deviations the
relative change of a probability is z^2 times this."""

FLAT = 1e-7
"""A direction with less than this share of the largest deviation has no noise: its eigenvalue, the
square, is at the level of rounding errors."""


def log_overlap(collision: Polytope, means: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    """Return (B,) log of Pr(D in K) for D ~ N(``means`` (B, d), ``covariances`` (B, d, d)).

    It is minus infinity only if no noise can lead into K.

    Raises
    ------
    InputError
        In more than three dimensions, unless K is a box and the covariances are diagonal.
    """
    result = np.empty(len(means))
    deviations = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2).clip(0.0))
    scale = deviations[:, :, None] * deviations[:, None, :]
    off = np.abs(covariances) * (1 - np.eye(collision.dim))
    easy = (off <= UNCORRELATED * scale).all(axis=(1, 2)) & is_box(collision.normals)
    result[easy] = _log_box(collision, means[easy], deviations[easy])
    hard = np.flatnonzero(~easy)
    require(
        hard.size == 0 or collision.dim <= 3,
        "shape",
        f"has dimension {collision.dim}",
        "use boxes and noise without correlation in more than three dimensions",
    )
    if hard.size:
        values, vectors = np.linalg.eigh(covariances[hard])
        spread = np.sqrt(values.clip(0.0))
        noisy = spread > np.maximum(FLAT * spread[:, -1:], tol.DEVIATION)
        whole = noisy.all(axis=1)
        some = hard[whole]
        if some.size:
            result[some] = _log_whitened(collision, means[some], covariances[some])
        for k in np.flatnonzero(~whole):
            root = vectors[k][:, noisy[k]] * spread[k][noisy[k]]
            result[hard[k]] = _log_degenerate(collision, means[hard[k]], root)
    return np.minimum(result, log_best_face(collision, means, covariances))


def log_best_face(collision: Polytope, means: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    """Return (B,) log of min_p Pr(a_p D <= b_p), an upper bound on Pr(D in K)."""
    normals = collision.normals
    clearance = means @ normals.T - collision.offsets
    square = np.einsum("fi,tij,fj->tf", normals, covariances, normals)
    deviations = np.sqrt(square.clip(0.0))
    deviations[deviations <= tol.DEVIATION] = 0.0
    return log_ndtr(-face_margins(clearance, deviations)).min(axis=1)


def is_box(normals: np.ndarray) -> bool:
    """Return whether faces with unit ``normals`` (F, d) are those of a box along the axes."""
    return len(normals) == 2 * normals.shape[1] and bool(
        (np.abs(normals).max(axis=1) >= 1 - tol.FACE**2).all()
    )


@lru_cache(maxsize=1024)
def surface(polytope: Polytope) -> np.ndarray:
    """Return (S, 3) corners of triangles that cover a surface, counter-clockwise from outside."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(polytope.vertices)
    corners = polytope.vertices[hull.simplices]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normal * hull.equations[:, :3]).sum(axis=1) < 0
    triangles = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    triangles.setflags(write=False)
    return triangles


def log_standard(polytope: Polytope, corners: np.ndarray) -> np.ndarray:
    """Return (B,) log of Pr(z in image) for z standard normal and images of a polytope.

    ``corners`` (B, V, d) are the vertices under linear maps that keep the orientation.
    """
    if polytope.dim == 1:
        return log_interval(corners.min(axis=(1, 2)), corners.max(axis=(1, 2)))
    if polytope.dim == 2:
        return log_polygon(corners)
    return log_polyhedron(corners, surface(polytope))


def _log_box(collision: Polytope, means: np.ndarray, deviations: np.ndarray) -> np.ndarray:
    low, high = collision.vertices.min(axis=0) - means, collision.vertices.max(axis=0) - means
    noisy = deviations > tol.DEVIATION
    inside = (low < -tol.LENGTH) & (high > tol.LENGTH)
    unit = np.where(noisy, deviations, 1.0)
    certain = np.where(inside, 0.0, -np.inf)
    return np.where(noisy, log_interval(low / unit, high / unit), certain).sum(axis=1)


def _log_whitened(collision: Polytope, means: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    roots = np.linalg.cholesky(covariances)
    away = collision.vertices - means[:, None, :]
    result = log_standard(
        collision, np.swapaxes(np.linalg.solve(roots, np.swapaxes(away, 1, 2)), 1, 2)
    )
    # For a set too thin for the integral, fall back on the bound.
    return np.where(np.isneginf(result), log_best_face(collision, means, covariances), result)


def _log_degenerate(collision: Polytope, mean: np.ndarray, root: np.ndarray) -> float:
    """Return log of Pr(mean + ``root`` z in K) for root (d, k), k < d: z covers a slice of K."""
    if root.shape[1] == 0:
        return 0.0 if collision.clearance(mean) < -tol.LENGTH else -np.inf
    if root.shape[1] == 1:
        return _log_chord(collision, mean, root[:, 0])
    return _log_slice(collision, mean, root)


def _log_chord(collision: Polytope, mean: np.ndarray, direction: np.ndarray) -> float:
    slope = collision.normals @ direction
    room = collision.offsets - collision.normals @ mean
    level = np.abs(slope) <= FLAT * np.linalg.norm(direction)
    if (room[level] <= tol.LENGTH).any():
        return -np.inf
    with np.errstate(divide="ignore", over="ignore"):
        ends = room / slope
    low, high = ends[~level & (slope < 0)].max(), ends[~level & (slope > 0)].min()
    return float(log_interval(low, high))


def _log_slice(collision: Polytope, mean: np.ndarray, root: np.ndarray) -> float:
    """Return the log probability of a plane section, the polygon where the plane cuts edges."""
    normal = np.cross(root[:, 0], root[:, 1])
    height = (collision.vertices - mean) @ (normal / np.linalg.norm(normal))
    if height.min() >= -tol.LENGTH or height.max() <= tol.LENGTH:
        return -np.inf
    triangles = surface(collision)
    first, second = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    crossing = (height[first] >= 0) & (
        height[second] < 0
    )  # each edge once; it appears in both directions
    first, second = first[crossing], second[crossing]
    share = (height[first] / (height[first] - height[second]))[:, None]
    points = collision.vertices[first] * (1 - share) + collision.vertices[second] * share
    flat = (points - mean) @ np.linalg.pinv(root).T
    around = flat - flat.mean(axis=0)
    order = np.argsort(np.arctan2(around[:, 1], around[:, 0]))
    return float(log_polygon(flat[order][None])[0])
