"""Convex hulls and half-space intersections: faces from vertices, and vertices from faces."""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require

LEAST, MOST = 1e-3, 1e6
"""Sizes of points that qhull's tolerances serve as they are."""

FAR = 1e5
"""Distance of points from the origin, in their extents, beyond which they are moved there."""


def faces_of(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit normals (F, d) and offsets (F,) of conv(vertices), coplanar facets merged.

    Offsets are recomputed as supports, so every vertex satisfies every face exactly.
    """
    if vertices.shape[1] == 1:
        normals = np.array([[1.0], [-1.0]])
    else:
        normals = _distinct(_hull(_near_one(vertices)).equations)[:, :-1]
    return normals, (normals @ vertices.T).max(axis=1)


def _distinct(rows: np.ndarray) -> np.ndarray:
    scale = max(1.0, float(np.abs(rows).max()))
    kept: list[np.ndarray] = []
    for row in rows:
        if all(np.abs(row - other).max() > tol.FACE * scale for other in kept):
            kept.append(row)
    return np.array(kept)


def corners_of_points(points: np.ndarray) -> np.ndarray:
    """Return the extreme points (V, d) of ``points`` (P, d)."""
    if points.shape[1] == 1:
        return np.array([[points.min()], [points.max()]])
    return points[_hull(_near_one(points)).vertices]


def _near_one(points: np.ndarray) -> np.ndarray:
    """Return ``points`` in a unit and around a centre that qhull's tolerances serve."""
    size = float(np.ptp(points, axis=0).max())
    if np.abs(points).max() > FAR * size:
        points = points - points.mean(axis=0)
    return points if LEAST <= size <= MOST else points / size


def _hull(points: np.ndarray) -> Any:
    from scipy.spatial import ConvexHull, QhullError

    try:
        return ConvexHull(points)
    except QhullError:
        raise _too_close() from None


def _too_close() -> InputError:
    return InputError(
        "",
        "has corners that are too close to each other for the size of their coordinates",
        "bring the coordinates near the origin and the corners apart",
    )


def corners_of_halfspaces(normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the vertices (V, d) of { x : normals x <= offsets }.

    Raises
    ------
    InputError
        If the set is empty, flat or unbounded.
    """
    size = float(np.abs(offsets / np.linalg.norm(normals, axis=1)).max())
    if size and not LEAST <= size <= MOST:
        return size * corners_of_halfspaces(normals, offsets / size)
    centre = _chebyshev_centre(normals, offsets)
    _require_bounded(normals, offsets)
    if normals.shape[1] == 1:
        limits = offsets / normals[:, 0]
        return np.array(
            [[limits[normals[:, 0] < 0].max()], [limits[normals[:, 0] > 0].min()]],
        )
    return corners_of_points(_intersections(normals, offsets, centre))


def _chebyshev_centre(normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    from scipy.optimize import linprog

    lengths = np.linalg.norm(normals, axis=1)
    dim = normals.shape[1]
    # The radius is capped, so that an unbounded set has a centre too.
    solution = linprog(
        np.r_[np.zeros(dim), -1.0],
        A_ub=np.column_stack([normals, lengths]),
        b_ub=offsets,
        bounds=[(None, None)] * dim + [(0, 1e6)],
    )
    require(
        solution.status == 0 and solution.x[-1] > tol.FLAT,
        "",
        "describes an empty or flat set",
        "loosen the half-planes until they leave some room",
    )
    return solution.x[:-1]


def _require_bounded(normals: np.ndarray, offsets: np.ndarray) -> None:
    from scipy.optimize import linprog

    dim = normals.shape[1]
    for direction in np.concatenate([np.eye(dim), -np.eye(dim)]):
        extent = linprog(-direction, A_ub=normals, b_ub=offsets, bounds=[(None, None)] * dim)
        require(extent.status == 0, "", "describes an unbounded set", "add half-planes to close it")


def _intersections(normals: np.ndarray, offsets: np.ndarray, inside: np.ndarray) -> np.ndarray:
    from scipy.spatial import HalfspaceIntersection, QhullError

    try:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            points = HalfspaceIntersection(np.column_stack([normals, -offsets]), inside)
    except QhullError:
        raise _too_close() from None
    if not np.isfinite(points.intersections).all():
        raise _too_close()
    return points.intersections


def in_order(corners: np.ndarray) -> np.ndarray:
    """Return ``corners`` counter-clockwise in the plane (for drawing); unchanged elsewhere."""
    if corners.shape[1] != 2:
        return corners
    around = corners - corners.mean(axis=0)
    return corners[np.argsort(np.arctan2(around[:, 1], around[:, 0]), kind="stable")]


def require_volume(points: np.ndarray) -> None:
    """Refuse ``points`` (P, d) whose convex hull has no volume, within ``tol.FLAT``."""
    dim = points.shape[1]
    solid = len(points) > dim
    if solid:
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        solid = bool(spread[-1] > tol.FLAT * spread[0])
    require(
        solid,
        "",
        "has vertices that lie in a plane or on a line, so its volume is zero",
        f"give at least {dim + 1} points in general position",
    )
