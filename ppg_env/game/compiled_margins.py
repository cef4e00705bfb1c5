"""The rules of :mod:`ppg_env.game.margins` for one displacement, as scalars for compiled loops.

Both kernels (:mod:`ppg_env.env.kernel`, :mod:`ppg_env.risk.kernel`) call these functions, which
are inlined.  Numba's cache on disk does not see that an inlined function has changed: after an
edit here, delete the folders ``__pycache__`` of ``env`` and ``risk``.

The displacement is that of bodies i and j, or of body i and an obstacle at rest (j = -1), in copy
c of ``state`` (C, bodies, n).  ``axes`` holds d zeros: the length of a tuple is part of its type,
so the compiler unrolls loops over components.  The encounter's faces are those from ``first`` up
to ``last``.

During a step bodies move on straight lines, and so does their displacement: from that in
``before`` to that in ``after``.
"""

from __future__ import annotations

import numpy as np

from ppg_env.support.compilation import njit
from ppg_env.tolerances import LENGTH


@njit(inline="always")
def within(reach: float, depth: float) -> bool:
    """Return whether a point that reaches so far along a face's normal is on its inner side.

    A ``depth`` is an offset less the tolerance within which bodies only touch.  Positions that
    overflowed to nan are on the inner side of every face.
    """
    return not reach > depth


@njit(inline="always")
def face_margin(clearance: float, unit: float) -> float:
    """Return the margin of one face; see :func:`ppg_env.game.margins.face_margins`."""
    if unit > 0.0:
        return clearance / unit
    return np.inf if clearance >= -LENGTH else -np.inf


@njit(inline="always")
def best_face(
    axes: tuple[int, ...], state: np.ndarray, c: int, i: int, j: int, normals: np.ndarray,
    offsets: np.ndarray, first: int, last: int, units: np.ndarray, row: int,
) -> float:  # fmt: skip
    """Return the margin of a displacement, without cap, in ``units`` (times, faces) at ``row``."""
    best = -np.inf
    for f in range(first, last):
        clear = -offsets[f]
        for k in range(len(axes)):
            clear += normals[f, k] * (state[c, i, k] - (state[c, j, k] if j >= 0 else 0.0))
        best = max(best, face_margin(clear, units[row, f]))
    return best


@njit(inline="always")
def inside(
    axes: tuple[int, ...], state: np.ndarray, c: int, i: int, j: int, normals: np.ndarray,
    depths: np.ndarray, first: int, last: int,
) -> bool:  # fmt: skip
    """Return whether a displacement lies in the collision set by more than a touch."""
    contained = True
    for f in range(first, last):
        reach = 0.0
        for k in range(len(axes)):
            reach += normals[f, k] * (state[c, i, k] - (state[c, j, k] if j >= 0 else 0.0))
        if not within(reach, depths[f]):
            contained = False
            break
    return contained


@njit(inline="always")
def clip(p: float, q: float, start: float, end: float) -> tuple[float, float]:
    """Cut the part from ``start`` to ``end`` of a segment to the inner side of a face.

    The ends of the segment are ``p`` and ``q`` beyond the face; 0 and 1 are their places.  A
    part that starts after its end is empty.  Source: Cyrus & Beck, Computers & Graphics 3 (1978).
    """
    if p > 0.0 and q > 0.0:
        return 1.0, 0.0
    if p > 0.0:
        start = max(start, p / (p - q))
    elif q > 0.0:
        end = min(end, p / (p - q))
    return start, end


@njit(inline="always")
def crossing(
    axes: tuple[int, ...], before: np.ndarray, after: np.ndarray, c: int, i: int, j: int,
    normals: np.ndarray, depths: np.ndarray, first: int, last: int,
) -> bool:  # fmt: skip
    """Return whether a displacement meets the collision set during a step by more than a touch."""
    start, end = 0.0, 1.0
    for f in range(first, last):
        p, q = -depths[f], -depths[f]
        for k in range(len(axes)):
            p += normals[f, k] * (before[c, i, k] - (before[c, j, k] if j >= 0 else 0.0))
            q += normals[f, k] * (after[c, i, k] - (after[c, j, k] if j >= 0 else 0.0))
        start, end = clip(p, q, start, end)
        if start > end:
            break
    return start <= end


@njit(inline="always")
def best_step_face(
    axes: tuple[int, ...], before: np.ndarray, after: np.ndarray, c: int, i: int, j: int,
    normals: np.ndarray, offsets: np.ndarray, first: int, last: int, units: np.ndarray, row: int,
    next_row: int,
) -> float:  # fmt: skip
    """Return the margin of a step, without cap; units are those at its start and at its end."""
    best = -np.inf
    for f in range(first, last):
        p, q = -offsets[f], -offsets[f]
        for k in range(len(axes)):
            p += normals[f, k] * (before[c, i, k] - (before[c, j, k] if j >= 0 else 0.0))
            q += normals[f, k] * (after[c, i, k] - (after[c, j, k] if j >= 0 else 0.0))
        lower = min(face_margin(p, units[row, f]), face_margin(q, units[next_row, f]))
        best = max(best, lower)
    return best
