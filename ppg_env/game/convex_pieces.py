r"""Split a simple polygon into convex pieces.

Ears are cut off until triangles remain (Meisters 1975); diagonals that no corner needs are removed
again (Hertel and Mehlhorn 1983), which leaves at most four times the least number of pieces.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.game.polytope import Polytope
from ppg_env.support.validation import finite_array

MOST_CORNERS = 200


def convex_pieces(corners: Any) -> list[Polytope]:
    """Return convex polygons that cover the polygon with these ``corners`` (V, 2), in order.

    Raises
    ------
    InputError
        If there are too few corners or too many, or the outline crosses or touches itself.
    """
    remedy = "write at least three corners [x, y] in order around the polygon"
    points = finite_array(corners, "polygon", remedy)
    require(
        points.ndim == 2 and points.shape[1] == 2 and len(points) >= 3,
        "polygon",
        "is not a list of corners in the plane",
        remedy,
    )
    require(
        len(points) <= MOST_CORNERS,
        "polygon",
        f"has {len(points)} corners",
        f"use at most {MOST_CORNERS}",
    )
    ring = _simplified(points)
    require(len(ring) >= 3, "polygon", "has no area", remedy)
    _check_simple(ring)
    if _area(ring) < 0:
        ring = ring[::-1]
    pieces = _merged(_triangles(list(range(len(ring))), ring), ring)
    return [Polytope.from_vertices(ring[piece]) for piece in pieces]


def _simplified(points: np.ndarray) -> np.ndarray:
    """Return the corners without repeated ones and without those on a straight line."""
    scale = float(np.ptp(points, axis=0).max())
    kept = list(points)
    changed = True
    while changed and len(kept) >= 3:
        changed = False
        for k in range(len(kept)):
            before, here, after = kept[k - 1], kept[k], kept[(k + 1) % len(kept)]
            if abs(_turn(before, here, after)) <= tol.FLAT * scale**2:
                require(
                    float((here - before) @ (after - here)) >= 0,
                    "polygon",
                    f"folds back at {here.tolist()!s:.60}",
                    "remove that corner",
                )
                del kept[k]
                changed = True
                break
    return np.array(kept)


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> Any:
    """Return twice the signed area of a triangle, positive if it turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _area(ring: np.ndarray) -> float:
    x, y = ring.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def _check_simple(ring: np.ndarray) -> None:
    count = len(ring)
    for i in range(count):
        for j in range(i + 2, count):
            if (j + 1) % count == i:
                continue
            if _meet(ring[i], ring[(i + 1) % count], ring[j], ring[(j + 1) % count]):
                raise InputError(
                    "polygon",
                    f"has sides {i} and {j} that cross or touch",
                    "write the corners in order around a polygon whose sides do not cross",
                )


def _meet(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> bool:
    """Return whether the segments ab and cd have a point in common."""
    one, two = _turn(a, b, c), _turn(a, b, d)
    three, four = _turn(c, d, a), _turn(c, d, b)
    if one == two == 0:  # on one line: they meet if their extents do
        low, high = np.minimum(a, b), np.maximum(a, b)
        return bool((np.minimum(c, d) <= high).all() and (np.maximum(c, d) >= low).all())
    return one * two <= 0 and three * four <= 0


def _triangles(order: list[int], ring: np.ndarray) -> list[list[int]]:
    """Return triangles of corner numbers, counter-clockwise, that cover the polygon."""
    triangles = []
    while len(order) > 3:
        k = next((k for k in range(len(order)) if _is_ear(k, order, ring)), None)
        if k is None:
            raise InputError(
                "polygon", "cannot be split into convex pieces", "move corners that nearly touch"
            )
        triangles.append([order[k - 1], order[k], order[(k + 1) % len(order)]])
        del order[k]
    return [*triangles, order]


def _is_ear(k: int, order: list[int], ring: np.ndarray) -> bool:
    """Return whether corner k turns left and no other corner is in its triangle, edges included."""
    before, here, after = order[k - 1], order[k], order[(k + 1) % len(order)]
    a, b, c = ring[before], ring[here], ring[after]
    if _turn(a, b, c) <= 0:
        return False
    others = ring[[q for q in order if q not in (before, here, after)]].T
    inside = (_turn(a, b, others) >= 0) & (_turn(b, c, others) >= 0) & (_turn(c, a, others) >= 0)
    return not np.any(inside)


def _merged(pieces: list[list[int]], ring: np.ndarray) -> list[list[int]]:
    """Return the pieces after those on both sides of a diagonal were joined where that is convex.

    A diagonal that a corner needs stays needed when others are removed, so one pass suffices.
    """
    joined: list[list[int] | None] = list(pieces)
    owner = {side: k for k, piece in enumerate(pieces) for side in _sides(piece)}
    for a, b in list(owner):
        if a > b or (b, a) not in owner:
            continue
        i, j = owner[a, b], owner[b, a]
        union = _joined(joined[i] or [], joined[j] or [], a, b)
        if _is_convex(union, ring):
            joined[i], joined[j] = union, None
            owner |= dict.fromkeys(_sides(union), i)
            del owner[a, b], owner[b, a]
    return [piece for piece in joined if piece is not None]


def _sides(piece: list[int]) -> list[tuple[int, int]]:
    return list(pairwise([*piece, piece[0]]))


def _joined(first: list[int], second: list[int], a: int, b: int) -> list[int]:
    """Return the outline of two pieces: the first has the side a -> b, the second b -> a."""
    k, m = first.index(b), second.index(a)
    return [*first[k:], *first[:k], *second[m + 1 :], *second[:m]][:-1]  # b came first


def _is_convex(piece: list[int], ring: np.ndarray) -> bool:
    count = len(piece)
    return all(
        _turn(ring[piece[k - 1]], ring[piece[k]], ring[piece[(k + 1) % count]]) >= 0
        for k in range(count)
    )
