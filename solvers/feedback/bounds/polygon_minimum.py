r"""Compiled: the minimum of a piecewise linear function over a moving polygon.

The function is given at the nodes (i, j) of a mesh of unit squares, each split along its diagonal
i - j = const into two triangles.  On a triangle its part inside the polygon is smallest at a
corner of that part: at a node, at a corner of the polygon, or where a side of the polygon crosses
a line of the mesh.  Rows of nodes inside are read from a table of minima of 2^k neighbours.
Points outside the mesh are ignored.
"""

from __future__ import annotations

from math import ceil, floor, inf

import numpy as np

from ppg_env.support.compilation import njit

SLACK = 1e-9
"""Nodes that are outside the polygon by so little count as inside, which lowers the minimum."""


@njit(cache=True)
def minima_at_fixed_offsets(w: np.ndarray, polygon: np.ndarray, out: np.ndarray) -> None:
    """Write min of w over ``polygon`` (V, 2) + (i, j) for every node (i, j) of ``w``."""
    n, m = w.shape
    out[:] = inf
    points, count = _crossings(polygon)
    for k in range(count):
        i0, j0 = floor(points[k, 0]), floor(points[k, 1])
        x, y = points[k, 0] - i0, points[k, 1] - j0
        di, dj = (i0 + 1, j0) if x >= y else (i0, j0 + 1)
        a, b, c = 1.0 - max(x, y), abs(x - y), min(x, y)
        for i in range(max(0, -i0), min(n, n - (i0 + (x > 0.0)))):
            for j in range(max(0, -j0), min(m, m - (j0 + (y > 0.0)))):
                value = a * w[i + i0, j + j0]
                if b > 0.0:
                    value += b * w[i + di, j + dj]
                if c > 0.0:
                    value += c * w[i + i0 + 1, j + j0 + 1]
                out[i, j] = min(out[i, j], value)
    table = range_minima(w)
    for row in range(ceil(polygon[:, 0].min() - SLACK), floor(polygon[:, 0].max() + SLACK) + 1):
        low, high = _row(polygon, row)
        if low > high:
            continue
        level = _level(high - low + 1)
        last = high - (1 << level) + 1
        for i in range(max(0, -row), min(n, n - row)):
            for j in range(max(0, -low), min(m, m - high)):
                value = min(table[level, i + row, j + low], table[level, i + row, j + last])
                out[i, j] = min(out[i, j], value)
            for j in range(m):  # rows that leave the mesh
                if j + low < 0 or j + high >= m:
                    for q in range(max(0, j + low), min(m, j + high + 1)):
                        out[i, j] = min(out[i, j], w[i + row, q])


@njit(cache=True)
def minima_at_images(
    w: np.ndarray, polygon: np.ndarray, origin: np.ndarray, step: np.ndarray, out: np.ndarray
) -> None:
    """Write min of w over ``polygon`` + ``origin`` + ``step`` (i, j) for every node (i, j)."""
    n, m = out.shape
    table = range_minima(w)
    moved = np.empty_like(polygon)
    for i in range(n):
        for j in range(m):
            for a in range(2):
                moved[:, a] = polygon[:, a] + origin[a] + step[a, 0] * i + step[a, 1] * j
            out[i, j] = _minimum(w, table, moved)


@njit(cache=True)
def _minimum(w: np.ndarray, table: np.ndarray, polygon: np.ndarray) -> float:
    n, m = w.shape
    best = inf
    points, count = _crossings(polygon)
    for k in range(count):
        x, y = points[k, 0], points[k, 1]
        if x >= 0.0 and x <= n - 1 and y >= 0.0 and y <= m - 1:
            best = min(best, _value(w, x, y))
    first = max(0, ceil(polygon[:, 0].min() - SLACK))
    for row in range(first, min(n - 1, floor(polygon[:, 0].max() + SLACK)) + 1):
        low, high = _row(polygon, row)
        low, high = max(low, 0), min(high, m - 1)
        if low <= high:
            level = _level(high - low + 1)
            last = high - (1 << level) + 1
            best = min(best, min(table[level, row, low], table[level, row, last]))
    return best


@njit(cache=True)
def _value(w: np.ndarray, x: float, y: float) -> float:
    """Return the piecewise linear function at a point of the mesh."""
    n, m = w.shape
    i, j = min(floor(x), max(n - 2, 0)), min(floor(y), max(m - 2, 0))
    x, y = x - i, y - j
    value = (1.0 - max(x, y)) * w[i, j]
    if x > y:
        value += (x - y) * w[i + 1, j]
    elif y > x:
        value += (y - x) * w[i, j + 1]
    if min(x, y) > 0.0:
        value += min(x, y) * w[i + 1, j + 1]
    return value


@njit(cache=True)
def range_minima(w: np.ndarray) -> np.ndarray:
    """Return (K, n, m) minima of w over 2^k nodes from j on; the last ones of a row are inf."""
    n, m = w.shape
    levels = _level(m) + 1
    table = np.full((levels, n, m), inf)
    table[0] = w
    for k in range(1, levels):
        half = 1 << (k - 1)
        for i in range(n):
            for j in range(m - 2 * half + 1):
                table[k, i, j] = min(table[k - 1, i, j], table[k - 1, i, j + half])
    return table


@njit(cache=True)
def _level(count: int) -> int:
    level = 0
    while (2 << level) <= count:
        level += 1
    return level


@njit(cache=True)
def _row(polygon: np.ndarray, row: int) -> tuple[int, int]:
    """Return the first and the last node of a row in the polygon."""
    low, high = inf, -inf
    count = polygon.shape[0]
    for k in range(count):
        q = k + 1 if k + 1 < count else 0
        a, b = polygon[k, 0] - row, polygon[q, 0] - row
        if abs(a) <= SLACK:
            low, high = min(low, polygon[k, 1]), max(high, polygon[k, 1])
        if (a < 0.0) != (b < 0.0):
            y = polygon[k, 1] + (polygon[q, 1] - polygon[k, 1]) * (a / (a - b))
            low, high = min(low, y), max(high, y)
    if low > high:
        return 0, -1
    return ceil(low - SLACK), floor(high + SLACK)


@njit(cache=True)
def _crossings(polygon: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the corners of a polygon and the points where its sides cross the mesh."""
    sides = polygon.shape[0]
    size = sides
    for k in range(sides):
        q = k + 1 if k + 1 < sides else 0
        dx, dy = polygon[q, 0] - polygon[k, 0], polygon[q, 1] - polygon[k, 1]
        size += 6 + ceil(abs(dx)) + ceil(abs(dy)) + ceil(abs(dx - dy))
    points, count = np.empty((size, 2)), 0
    for k in range(sides):
        q = k + 1 if k + 1 < sides else 0
        ax, ay, bx, by = polygon[k, 0], polygon[k, 1], polygon[q, 0], polygon[q, 1]
        points[count, 0], points[count, 1] = ax, ay
        count += 1
        for family in range(3):
            start, end = ax, bx
            if family == 1:
                start, end = ay, by
            elif family == 2:
                start, end = ax - ay, bx - by
            for level in range(ceil(min(start, end)), floor(max(start, end)) + 1):
                if start == end:
                    continue
                share = (level - start) / (end - start)
                x, y = ax + share * (bx - ax), ay + share * (by - ay)
                points[count, 0] = level if family == 0 else x
                points[count, 1] = level if family == 1 else y
                count += 1
    return points, count
