"""Convex hulls and half-space intersections: faces from vertices, and vertices from faces.

A set without volume is treated in its own plane (:mod:`ppg_env.game.flat_sets`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.game.flat_sets import Frame, frame_of_halfspaces, lifted_faces

LEAST, MOST = 1e-3, 1e6
"""Sizes of points that qhull's tolerances serve as they are."""

FAR = 1e5
"""Distance of points from the origin, in their extents, beyond which they are moved there."""


def faces_of(vertices: np.ndarray, frame: Frame | None) -> tuple[np.ndarray, np.ndarray]:
    """Return unit normals (F, d) and offsets (F,) of conv(vertices), coplanar facets merged.

    ``frame`` is that of a flat set, whose last faces are across it; None for a solid one.
    Offsets are recomputed as supports, so every vertex satisfies every face exactly.
    """
    if frame is None:
        normals = _solid_faces(vertices)
    else:
        normals = lifted_faces(_solid_faces(vertices @ frame[0]), frame)
    return normals, (normals @ vertices.T).max(axis=1)


def _solid_faces(vertices: np.ndarray) -> np.ndarray:
    if vertices.shape[1] == 0:
        return np.zeros((0, 0))
    if vertices.shape[1] == 1:
        return np.array([[1.0], [-1.0]])
    return _distinct(_hull(_near_one(vertices)).equations)[:, :-1]


def _distinct(rows: np.ndarray) -> np.ndarray:
    scale = max(1.0, float(np.abs(rows).max()))
    kept: list[np.ndarray] = []
    for row in rows:
        if all(np.abs(row - other).max() > tol.FACE * scale for other in kept):
            kept.append(row)
    return np.array(kept)


def corners_of_points(points: np.ndarray, frame: Frame | None = None) -> np.ndarray:
    """Return the extreme points (V, d) of ``points`` (P, d); ``frame`` is that of a flat set."""
    if frame is not None:
        return points[_extreme(points @ frame[0])]
    if points.shape[1] == 1:
        return np.array([[points.min()], [points.max()]])
    return points[_hull(_near_one(points)).vertices]


def _near_one(points: np.ndarray) -> np.ndarray:
    """Return ``points`` in a unit and around a centre that qhull's tolerances serve."""
    size = float(np.ptp(points, axis=0).max())
    if np.abs(points).max() > FAR * size:
        points = points - points.mean(axis=0)
    return points if not size or LEAST <= size <= MOST else points / size


def _extreme(points: np.ndarray) -> Any:
    if points.shape[1] == 0:
        return [0]
    if points.shape[1] == 1:
        return [int(points.argmin()), int(points.argmax())]
    return _hull(points).vertices


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
        If the set is empty, unbounded, or too thin without being flat.
    """
    size = float(np.abs(offsets / np.linalg.norm(normals, axis=1)).max())
    if size and not LEAST <= size <= MOST:
        return size * corners_of_halfspaces(normals, offsets / size)
    centre, radius = _chebyshev_centre(normals, offsets)
    _require_bounded(normals, offsets)
    if radius <= tol.FLAT:
        return _flat_corners(normals, offsets, centre)
    return _solid_corners(normals, offsets, centre)


def _solid_corners(normals: np.ndarray, offsets: np.ndarray, centre: np.ndarray) -> np.ndarray:
    if normals.shape[1] == 1:
        limits = offsets / normals[:, 0]
        return np.array(
            [[limits[normals[:, 0] < 0].max()], [limits[normals[:, 0] > 0].min()]],
        )
    return corners_of_points(_intersections(normals, offsets, centre))


def _flat_corners(normals: np.ndarray, offsets: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Return the vertices of a flat set, those of a solid one in its plane."""
    lengths = np.linalg.norm(normals, axis=1)
    normals, offsets = normals / lengths[:, None], offsets / lengths
    plane = frame_of_halfspaces(normals, offsets, inside)
    if plane is None:
        raise _empty()
    centre, (along, _) = plane
    if along.shape[1] == 0:
        return centre[None]
    rows, limits = normals @ along, offsets - normals @ centre
    crossing = np.linalg.norm(rows, axis=1) > tol.FLAT
    rows, limits = rows[crossing], limits[crossing]
    inner, radius = _chebyshev_centre(rows, limits)
    if radius <= tol.FLAT:
        raise _empty()
    return centre + _solid_corners(rows, limits, inner) @ along.T


def _chebyshev_centre(normals: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, float]:
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
    if solution.status != 0:
        raise _empty()
    return solution.x[:-1], float(solution.x[-1])


def _empty() -> InputError:
    return InputError(
        "",
        "describes an empty set, or one too thin for double arithmetic",
        "loosen the half-planes until they leave some room",
    )


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
