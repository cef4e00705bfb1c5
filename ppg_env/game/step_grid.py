r"""The least number of steps past bodies at rest, over cells of the plane.

At both ends of a step, one and the same face of each body is clear.  So a step leads from a cell c
to a cell c' only if some displacement between them is within reach, and each body has a face that
is clear somewhere in c and somewhere in c'.  The least number of such steps to the goal's cell is a
lower bound.  It sees what the length of a way does not: where a way bends around a corner, a step
ends.
"""

from __future__ import annotations

import numpy as np

from ppg_env.game.barriers import Barrier
from ppg_env.game.cells import SLACK, Cells

MOST_FACES = 64
"""Faces of a body that are distinguished; bodies with more do not count."""

Move = tuple[int, int]


def least_hops(
    cells: Cells, bodies: list[Barrier], kernel: np.ndarray, start: np.ndarray, goal: np.ndarray
) -> int | None:
    """Return a lower bound on the number of steps from ``start`` to ``goal``; None without a way.

    ``kernel`` is the mask of displacements between cells in one step, none in its middle.
    """
    moves = [(int(a), int(b)) for a, b in np.argwhere(kernel) - np.array(kernel.shape) // 2]
    allowed = _allowed(cells, bodies, moves)
    last, reached = cells.near(goal), cells.near(start)
    front, hops = reached, 0
    while front.any():
        after, hops = np.zeros_like(front), hops + 1
        for move, mask in allowed.items():
            source, target = _ends(cells.shape, move)
            after[target] |= front[source] & mask
        if (after & last).any():
            return hops
        front = after & ~reached
        reached = reached | front
    return None


def _allowed(cells: Cells, bodies: list[Barrier], moves: list[Move]) -> dict[Move, np.ndarray]:
    """Return which cells each move may leave, of those from which it stays within the cells."""
    result = {move: np.ones(cells.shape, dtype=bool)[_ends(cells.shape, move)[0]] for move in moves}
    longest = np.abs(moves).max(axis=0) * cells.size
    for body in bodies:
        low, high = (bound + body.path[0] for bound in body.collision.bounds)
        window = cells.window(low - longest, high + longest)
        faces = _clear_faces(cells, body, window)
        for move in moves if faces is not None else ():
            assert faces is not None
            source, target = _ends(faces.shape, move)
            places = tuple(
                slice(w.start + part.start - max(0, -m), w.start + part.stop - max(0, -m))
                for w, part, m in zip(window, source, move, strict=True)
            )
            result[move][places] &= (faces[source] & faces[target]) != 0
    return result


def _clear_faces(cells: Cells, body: Barrier, window: tuple[slice, ...]) -> np.ndarray | None:
    """Return the faces that are clear somewhere in each cell of a window, as bits."""
    normals, offsets = body.collision.faces
    if len(offsets) > MOST_FACES:
        return None
    limits = offsets + normals @ body.path[0] - SLACK
    result = np.zeros([part.stop - part.start for part in window], dtype=np.uint64)
    for f, (normal, limit) in enumerate(zip(normals, limits.tolist(), strict=True)):
        result |= (cells.along(normal, window, 1) >= limit).astype(np.uint64) << np.uint64(f)
    return result


def _ends(shape: tuple[int, ...], move: Move) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return the cells of a grid from which a move stays in it, and those to which it leads."""
    pairs = list(zip(shape, move, strict=True))
    source = tuple(slice(max(0, -m), max(n - max(0, m), max(0, -m))) for n, m in pairs)
    target = tuple(slice(max(0, m), max(n - max(0, -m), max(0, m))) for n, m in pairs)
    return source, target
