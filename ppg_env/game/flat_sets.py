r"""Sets without volume, such as a segment in the plane: control sets may be flat.

    { x : x = c + Q y, y in P },   Q' Q = I,   N' (x - c) = 0

with P solid in fewer dimensions; the faces of the set are those of P and both signs of N.
"""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError

EXACT = 1e-12
"""Points this close to a plane, relative to their coordinates, are on it; further out, up to
``tol.FLAT``, a set is too thin for double arithmetic."""

Frame = tuple[np.ndarray, np.ndarray]
"""Orthonormal columns Q (d, k) along a flat set, and N (d, d-k) across it."""


def frame_of_points(points: np.ndarray) -> Frame | None:
    """Return the frame of the smallest plane that contains ``points`` (P, d); None if they fill it.

    Raises
    ------
    InputError
        If the points are nearly, but not exactly, in a plane.
    """
    rows = points - points.mean(axis=0)
    _, spread, axes = np.linalg.svd(rows, full_matrices=len(rows) < rows.shape[1])
    spread = np.concatenate([spread, np.zeros(len(axes) - len(spread))])
    along = spread > EXACT * np.abs(points).max()
    if along.all() and spread[-1] > tol.FLAT * spread[0]:
        return None
    if (along & (spread <= tol.FLAT * spread[0])).any():
        raise InputError(
            "",
            "has vertices that nearly lie in a plane or on a line, too thin for double arithmetic",
            "move them apart, or exactly onto it",
        )
    return axes[along].T, axes[~along].T


def frame_of_halfspaces(
    normals: np.ndarray, offsets: np.ndarray, inside: np.ndarray
) -> tuple[np.ndarray, Frame] | None:
    """Return a point c and the frame of { x : normals x <= offsets }, of unit normals.

    ``inside`` is a point that a linear program found in the set.  The faces whose opposite the set
    touches give the frame; the result is None if no point meets them exactly.
    """
    from scipy.optimize import linprog

    free, scale = (None, None), max(float(np.abs(offsets).max()), float(np.abs(inside).max()))
    level = []
    for normal, offset in zip(normals, offsets, strict=True):
        lowest = linprog(normal, A_ub=normals, b_ub=offsets, bounds=free)
        level.append(lowest.status == 0 and offset - lowest.fun <= 1e-7 * scale)
    rows, limits = normals[level], offsets[level]
    point = inside + np.linalg.lstsq(rows, limits - rows @ inside, rcond=None)[0]
    if not len(rows) or np.abs(rows @ point - limits).max() > EXACT * scale:
        return None
    _, sizes, axes = np.linalg.svd(rows)
    sizes = np.concatenate([sizes, np.zeros(len(axes) - len(sizes))])
    return point, (axes[sizes <= tol.FLAT].T, axes[sizes > tol.FLAT].T)


def lifted_faces(faces: np.ndarray, frame: Frame) -> np.ndarray:
    """Return the unit normals (F, d) of a flat set whose normals along its plane are ``faces``."""
    along, across = frame
    return np.concatenate([faces @ along.T, across.T, -across.T])
