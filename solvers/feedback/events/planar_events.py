r"""Compiled: the probability that a Gaussian end point in the plane lies in a set, or behind it.

Points are whitened, so that the end point is z + N(0, I).  In polar coordinates around z, with h
the distance of an edge's line, positive where z is on its left, u the position along the line and
q = h^2 + u^2,

    Pr = 1/(2 pi) sum_edges int (1 - exp(-q/2)) d alpha,     d alpha = h du / q,

over the counter-clockwise boundary of the set.  An edge may be a half-line; the arc at infinity
between two of them adds its angle.  Where q exceeds ``REACH``^2, the integrand is 1 and the
integral an angle.

A step that starts at x outside a convex set K meets K iff its end lies in the shadowed set

    { x + s (k - x) : k in K, s >= 1 },

which is convex: its boundary is the part of the boundary of K that faces x, from corner a to
corner b, and the two half-lines from a and from b away from x.
"""

from __future__ import annotations

from math import atan2, ceil, erfc, exp, hypot, inf, pi, sqrt

import numpy as np

from ppg_env.support.compilation import njit

REACH = 8.6
"""Distances beyond it are infinite: exp(-REACH^2 / 2) is below 1e-16."""

PANEL, SHORT = 2.4, 0.8
"""Longest part of an edge for one rule of 12 nodes, and of 6 nodes: an error below 1e-13."""

_LONG_NODES, _LONG_WEIGHTS = np.polynomial.legendre.leggauss(12)
_SHORT_NODES, _SHORT_WEIGHTS = np.polynomial.legendre.leggauss(6)

COINCIDENT = 1e-12
"""A corner closer to the start of a step, relative to the size of the set, coincides with it."""


@njit(cache=True)
def interval(low: float, high: float) -> float:
    """Return Pr(low < z < high) of a standard normal z."""
    if high <= low:
        return 0.0
    if low > -high:  # both tails are small on the left
        low, high = -high, -low
    return 0.5 * (erfc(-high / sqrt(2.0)) - erfc(-low / sqrt(2.0)))


@njit(cache=True)
def box_probability(
    low: np.ndarray, high: np.ndarray, mean: np.ndarray, deviation: np.ndarray, out: np.ndarray
) -> None:
    """Write Pr(low < mean + deviation z < high) for ``mean`` (B, d); axes are independent.

    Where ``deviation`` (d,) is zero, the component is certain.
    """
    for k in range(mean.shape[0]):
        value = 1.0
        for a in range(mean.shape[1]):
            below, above = low[a] - mean[k, a], high[a] - mean[k, a]
            if deviation[a] > 0.0:
                value *= interval(below / deviation[a], above / deviation[a])
            elif below >= 0.0 or above <= 0.0:
                value = 0.0
            if value == 0.0:
                break
        out[k] = value


@njit(cache=True)
def polygon_probability(corners: np.ndarray, mean: np.ndarray, out: np.ndarray) -> None:
    """Write Pr(mean + z in polygon) for ``mean`` (B, 2); ``corners`` (V, 2) counter-clockwise."""
    count = corners.shape[0]
    edges, lines = np.empty((count, 4)), np.empty((count, 3))
    _sides(corners, edges)
    for k in range(mean.shape[0]):
        total = 0.0
        if _seen_from(edges, count, mean[k, 0], mean[k, 1], lines):
            for e in range(count):
                total += _edge(lines[e, 0], lines[e, 1], lines[e, 2])
        out[k] = min(max(total / (2 * pi), 0.0), 1.0)


@njit(cache=True)
def shadow_probability(
    corners: np.ndarray, before: np.ndarray, mean: np.ndarray, out: np.ndarray
) -> None:
    """Write Pr(the segment from ``before`` to mean + z meets the polygon); arrays (B, 2)."""
    edges, lines = np.empty((corners.shape[0] + 2, 4)), np.empty((corners.shape[0] + 2, 3))
    for k in range(mean.shape[0]):
        count = _shadow(corners, before[k, 0], before[k, 1], edges)
        if count == 0:
            out[k] = 1.0
            continue
        total = 0.0
        if _seen_from(edges, count, mean[k, 0], mean[k, 1], lines):
            total = _arc(edges, count) + _edge(lines[0, 0], -inf, lines[0, 1])
            for e in range(1, count - 1):
                total += _edge(lines[e, 0], lines[e, 1], lines[e, 2])
            total += _edge(lines[count - 1, 0], lines[count - 1, 1], inf)
        out[k] = min(max(total / (2 * pi), 0.0), 1.0)


@njit(cache=True)
def chord_probability(
    corners: np.ndarray,
    swept: bool,
    before: np.ndarray,
    mean: np.ndarray,
    root: np.ndarray,
    out: np.ndarray,
) -> None:
    """Write the probabilities for end points mean + ``root`` z, z one standard normal.

    ``root`` (2,) may be zero.  With ``swept`` it is that of :func:`shadow_probability`, else that
    of :func:`polygon_probability`.
    """
    count = corners.shape[0]
    edges = np.empty((count + 2, 4))
    _sides(corners, edges)
    for k in range(mean.shape[0]):
        if swept:
            count = _shadow(corners, before[k, 0], before[k, 1], edges)
            if count == 0:
                out[k] = 1.0
                continue
        out[k] = _chord(edges, count, mean[k, 0], mean[k, 1], root[0], root[1])


@njit(cache=True)
def _sides(corners: np.ndarray, edges: np.ndarray) -> None:
    """Write the corner and the direction of every side of a polygon."""
    V = corners.shape[0]
    for v in range(V):
        w = v + 1 if v + 1 < V else 0
        for a in range(2):
            edges[v, a], edges[v, 2 + a] = corners[v, a], corners[w, a] - corners[v, a]


@njit(cache=True)
def _seen_from(edges: np.ndarray, count: int, x: float, y: float, lines: np.ndarray) -> bool:
    """Write the distance of each edge's line and its positions on it, as seen from (x, y).

    Return False as soon as all of the set is out of reach.
    """
    for e in range(count):
        px, py, tx, ty = edges[e, 0] - x, edges[e, 1] - y, edges[e, 2], edges[e, 3]
        length = max(hypot(tx, ty), 1e-300)
        start = (px * tx + py * ty) / length
        lines[e, 0], lines[e, 1], lines[e, 2] = (px * ty - py * tx) / length, start, start + length
        if lines[e, 0] <= -REACH:
            return False
    return True


@njit(cache=True)
def _chord(edges: np.ndarray, count: int, x: float, y: float, rx: float, ry: float) -> float:
    """Return Pr((x, y) + r z left of all edges)."""
    low, high, size = -inf, inf, hypot(rx, ry)
    for e in range(count):
        tx, ty = edges[e, 2], edges[e, 3]
        room = tx * (y - edges[e, 1]) - ty * (x - edges[e, 0])
        slope = tx * ry - ty * rx
        if abs(slope) <= 1e-12 * size * hypot(tx, ty):
            if room <= 0.0:
                return 0.0
        elif slope > 0.0:
            low = max(low, -room / slope)
        else:
            high = min(high, -room / slope)
    return interval(low, high)


@njit(cache=True)
def _shadow(corners: np.ndarray, x: float, y: float, edges: np.ndarray) -> int:
    """Write the boundary of what a convex set hides from (x, y); return the number of its edges.

    Rows of ``edges`` are a corner and the direction in which the boundary runs.  The first edge is
    a half-line that comes from infinity to its corner, the last one leaves its corner for infinity.
    The number is 0 where (x, y) is in the set.
    """
    V = corners.shape[0]
    first, size = -1, 0.0
    for v in range(V):
        before = v - 1 if v > 0 else V - 1
        size = max(size, abs(corners[v, 0] - corners[before, 0]))
        size = max(size, abs(corners[v, 1] - corners[before, 1]))
        if _faces(corners, v, x, y) and not _faces(corners, before, x, y):
            first = v
    if first < 0:
        return 0
    count, v = 1, first
    while count <= V and _faces(corners, v, x, y):
        w = v + 1 if v + 1 < V else 0
        for a in range(2):
            edges[count, a], edges[count, 2 + a] = corners[v, a], corners[w, a] - corners[v, a]
        count, v = count + 1, w
    previous, following = first - 1 if first > 0 else V - 1, v + 1 if v + 1 < V else 0
    dx, dy = _away(corners, first, previous, x, y, COINCIDENT * size)
    edges[0, 0], edges[0, 1] = corners[first, 0], corners[first, 1]
    edges[0, 2], edges[0, 3] = -dx, -dy
    dx, dy = _away(corners, v, following, x, y, COINCIDENT * size)
    edges[count, 0], edges[count, 1] = corners[v, 0], corners[v, 1]
    edges[count, 2], edges[count, 3] = dx, dy
    return count + 1


@njit(cache=True)
def _faces(corners: np.ndarray, v: int, x: float, y: float) -> bool:
    """Return whether (x, y) is on the outer side of the edge that starts at corner v."""
    w = v + 1 if v + 1 < corners.shape[0] else 0
    along_x, along_y = corners[w, 0] - corners[v, 0], corners[w, 1] - corners[v, 1]
    return along_x * (y - corners[v, 1]) - along_y * (x - corners[v, 0]) < 0.0


@njit(cache=True)
def _away(
    corners: np.ndarray, v: int, neighbour: int, x: float, y: float, least: float
) -> tuple[float, float]:
    """Return the direction from (x, y) to a corner; where they coincide, on to its neighbour."""
    dx, dy = corners[v, 0] - x, corners[v, 1] - y
    if abs(dx) + abs(dy) <= least:
        return corners[neighbour, 0] - corners[v, 0], corners[neighbour, 1] - corners[v, 1]
    return dx, dy


@njit(cache=True)
def _arc(edges: np.ndarray, count: int) -> float:
    """Return the angle at infinity from the last half-line to the first, 0 to pi."""
    ax, ay = edges[count - 1, 2], edges[count - 1, 3]
    bx, by = -edges[0, 2], -edges[0, 3]
    angle = atan2(ax * by - ay * bx, ax * bx + ay * by)
    return angle + 2 * pi if angle < -1.0 else angle  # rounded beyond pi


@njit(cache=True)
def _angle(h: float, start: float, end: float) -> float:
    """Return the signed angle of the part from ``start`` to ``end`` of a line."""
    if start == -inf:
        return atan2(h, -end)
    if end == inf:
        return atan2(h, start)
    return atan2(h * (end - start), h * h + start * end)


@njit(cache=True)
def _edge(h: float, start: float, end: float) -> float:
    """Return the integral of 1 - exp(-q/2) over the angle of an edge."""
    square = REACH * REACH - h * h
    half = sqrt(square) if square > 0.0 else 0.0
    low, high = max(start, -half), min(end, half)
    if low >= high:
        return _angle(h, start, end)
    total = 0.0
    if start < low:
        total += _angle(h, start, low)
    if end > high:
        total += _angle(h, high, end)
    return total + h * _integral(h * h, low, high)


@njit(cache=True)
def _integral(square: float, low: float, high: float) -> float:
    """Return the integral of (1 - exp(-q/2)) / q over u, q = ``square`` + u^2."""
    total, length = 0.0, high - low
    if length <= SHORT:
        for k in range(_SHORT_NODES.size):
            u = low + 0.5 * length * (1.0 + _SHORT_NODES[k])
            total += _SHORT_WEIGHTS[k] * _density(square + u * u)
        return 0.5 * length * total
    panels = ceil(length / PANEL)
    width = length / panels
    for p in range(panels):
        for k in range(_LONG_NODES.size):
            u = low + width * (p + 0.5 * (1.0 + _LONG_NODES[k]))
            total += _LONG_WEIGHTS[k] * _density(square + u * u)
    return 0.5 * width * total


@njit(cache=True)
def _density(q: float) -> float:
    """Return (1 - exp(-q/2)) / q."""
    if q < 1e-3:
        return 0.5 - q * (0.125 - q * (1.0 / 48.0 - q / 384.0))
    return (1.0 - exp(-0.5 * q)) / q
