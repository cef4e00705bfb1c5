r"""Probability that a standard normal point lies in a convex polytope, by integrals over its edges.

An interval is a difference of tails.  In the plane, polar coordinates around the mean turn the
integral over the set into one along its edges: with h the signed distance of an edge's line from
the origin, positive where the origin is on the inner side, u the position along the line and
q = h^2 + u^2 = r^2,

    Pr = 1/(2 pi) sum_edges int (1 - exp(-q/2)) d alpha,     d alpha = h du / q.

In space the divergence theorem, applied to the radial field whose divergence is the density, leaves
a sum over faces, and polar coordinates around the foot of each face a sum over the edges of faces:
with h now the signed distance of the face's plane, e that of the edge's line from the foot,

    Pr = sum_faces h sum_edges int (U(|h|) - U(r)) d alpha,  d alpha = e du / (e^2 + u^2),
    U(r) = erf(r / sqrt 2) / (4 pi r),                       r^2 = h^2 + e^2 + u^2.

Far from the origin these sums cancel.  Angles around a point outside add up to zero, so there
1 - exp(-q/2) may be replaced by -exp(-q/2), erf by -erfc, and U(|h|), where the foot is off the
face, by 0; the remaining terms decay as the probability does, and the factor exp(-d^2/2), d the
distance of the polytope, is kept as a logarithm.  All integrands are analytic on the scale of one
deviation, so one Gauss-Legendre rule on the part of an edge that matters is exact to many digits;
beyond that part the integral is an angle.
"""

from __future__ import annotations

import numpy as np
from scipy.special import erf, erfcx, log_ndtr

PANELS, NODES = 5, 14
"""Panels and nodes of the rule along an edge: 14 digits for a Gaussian over up to 20 deviations."""

NEAR = 2.0
"""Distance, in deviations, below which the near forms are used; at it both forms have about 14
digits."""

REACH = 90.0
"""Points with r^2 > d^2 + REACH are neglected: exp(-REACH / 2) is below 1e-19."""

TINY = 1e-300
"""Replaces zero where only the limit of a quotient matters."""


def log_interval(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return log of Pr(low < z < high) for a standard normal z; exact in both tails, any shape."""
    low, high = np.where(low + high > 0, (-high, -low), (low, high))  # the left tail is exact
    outer, inner = log_ndtr(low), log_ndtr(high)
    with np.errstate(divide="ignore", invalid="ignore"):
        tail = inner + np.log(-np.expm1(np.minimum(outer - inner, 0.0)))
        middle = np.log(0.5 * (erf(high / np.sqrt(2)) - erf(low / np.sqrt(2))))
    return np.where(high <= low, -np.inf, np.where(high > -1, middle, tail))


def log_polygon(corners: np.ndarray) -> np.ndarray:
    """Return (B,) log of Pr(z in polygon) for polygons of ``corners`` (B, V, 2).

    Corners are in order, clockwise or counter-clockwise.  The result is minus infinity for a
    polygon that is flat to rounding, or thinner than 1e-10.
    """
    first, second = corners, np.roll(corners, -1, axis=1)
    along = _unit(second - first)
    turn = np.sign(_cross(first, second).sum(axis=1))[:, None]  # counter-clockwise: 1
    height = turn * _cross(first, along)
    start, end = (along * first).sum(axis=-1), (along * second).sum(axis=-1)
    square = _nearest_square(height, _missed(start, end) ** 2)
    near = square < NEAR**2
    low, high = _clipped(start, end, square[:, None] + REACH - height**2)
    u, weight = _nodes(low, high)
    q = np.maximum(height[..., None] ** 2 + u**2, TINY)
    shift = square[:, None, None]
    value = np.where(near[:, None, None], -np.expm1(-q / 2), -np.exp((shift - q) / 2)) / q
    beyond = _angle(start, end, height) - _angle(low, high, height)
    parts = height * (weight * value).sum(axis=-1) + np.where(near[:, None], beyond, 0.0)
    return _log(parts.sum(axis=-1) / (2 * np.pi), near, square)


def log_polyhedron(corners: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return (B,) log of Pr(z in polytope) for ``corners`` (B, V, 3) and ``triangles`` (S, 3).

    The triangles cover the surface, each counter-clockwise from outside.  The result is minus
    infinity for a polytope that is flat to rounding.
    """
    first = corners[:, triangles]  # (B, S, 3, 3): first corner of each triangle's edges
    second = np.roll(first, -1, axis=2)
    along = _unit(second - first)
    normal = _unit(np.cross(along[:, :, 0], along[:, :, 1]))
    height = (normal * first[:, :, 0]).sum(axis=-1)  # (B, S)
    side = (np.cross(along, normal[:, :, None]) * first).sum(axis=-1)  # (B, S, 3)
    start, end = (along * first).sum(axis=-1), (along * second).sum(axis=-1)
    foot = _nearest_square(side, _missed(start, end) ** 2)  # (B, S), within the plane
    square = _nearest_square(height, foot)
    near, value = square < NEAR**2, np.empty(len(corners))
    for chosen in (near, ~near):
        if chosen.any():
            far = None if chosen is near else square[chosen]
            value[chosen] = _surface(
                height[chosen], foot[chosen], side[chosen], start[chosen], end[chosen], far
            )
    return _log(value, near, square)


def _surface(
    height: np.ndarray,
    foot: np.ndarray,
    side: np.ndarray,
    start: np.ndarray,
    end: np.ndarray,
    square: np.ndarray | None,
) -> np.ndarray:
    """Return the sum over faces and edges; with ``square`` = d^2 the far form times exp(d^2/2)."""
    shift = np.zeros((1, 1, 1)) if square is None else square[:, None, None]
    height, close = height[..., None], foot[..., None] < NEAR**2
    reach = (NEAR**2 if square is None else shift) + REACH
    low, high = _clipped(start, end, reach - height**2 - side**2)
    u, weight = _nodes(low, high)
    plane = np.maximum(side[..., None] ** 2 + u**2, TINY)
    far = None if square is None else shift
    # If the foot is far off, |h| may be so small that its potential overflows.
    base = np.where(close, _potential(np.where(close, np.abs(height), np.sqrt(reach)), far), 0.0)
    r = np.sqrt(height[..., None] ** 2 + plane)
    value = (base[..., None] - _potential(r, None if far is None else far[..., None])) / plane
    parts = height * side * (weight * value).sum(axis=-1)
    parts += height * base * (_angle(start, end, side) - _angle(low, high, side))
    if far is None:  # beyond the reach erf is 1 and leaves a solid angle
        beyond = _solid(start, end, height, side) - _solid(low, high, height, side)
        parts -= beyond / (4 * np.pi)
    return parts.sum(axis=(1, 2))


def _potential(r: np.ndarray, shift: np.ndarray | None) -> np.ndarray:
    """Return U(r); with ``shift`` = d^2 that of the far form times exp(d^2/2)."""
    r = np.maximum(r, TINY)
    if shift is None:
        return erf(r / np.sqrt(2)) / (4 * np.pi * r)
    # erfcx(x) = exp(x^2) erfc(x).
    return -np.exp((shift - r**2) / 2) * erfcx(r / np.sqrt(2)) / (4 * np.pi * r)


def _missed(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the distance of [start, end] from 0."""
    return np.maximum(np.maximum(start, -end), 0.0)


def _nearest_square(height: np.ndarray, aside: np.ndarray) -> np.ndarray:
    """Return (...,) squared distance of the origin from a body; 0 inside.

    Its pieces (..., S) lie at ``height``, at squared distance ``aside`` from the origin's foot.
    """
    return np.where((height >= 0).all(axis=-1), 0.0, (height**2 + aside).min(axis=-1))


def _clipped(
    start: np.ndarray, end: np.ndarray, square: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of [start, end] with u^2 below ``square``."""
    half = np.sqrt(np.maximum(square, 0.0))
    return np.clip(start, -half, half), np.clip(end, -half, half)


def _rule() -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and weights of the composite rule on [0, 1]."""
    x, weight = np.polynomial.legendre.leggauss(NODES)
    places = (np.arange(PANELS)[:, None] + (x + 1) / 2) / PANELS
    return places.ravel(), np.tile(weight / 2 / PANELS, PANELS)


_PLACES, _WEIGHTS = _rule()


def _nodes(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes u (..., K) in [low, high] and their weights."""
    length = (high - low)[..., None]
    return low[..., None] + length * _PLACES, length * _WEIGHTS


def _angle(start: np.ndarray, end: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Return the signed angle that [start, end] on a line at ``height`` subtends."""
    distance = np.abs(height)
    return np.sign(height) * (np.arctan2(end, distance) - np.arctan2(start, distance))


def _solid(start: np.ndarray, end: np.ndarray, height: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Return the height times the integral of 1/r d alpha over [start, end]."""

    def upto(u: np.ndarray) -> np.ndarray:
        return np.arctan2(height * u, np.abs(side) * np.sqrt(height**2 + side**2 + u**2))

    return np.sign(side) * (upto(end) - upto(start))


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Normalise vectors; a vector of length zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _log(value: np.ndarray, near: np.ndarray, square: np.ndarray) -> np.ndarray:
    """Return the logarithm of a sum whose far form has the factor exp(d^2/2)."""
    with np.errstate(divide="ignore"):
        return np.log(np.clip(value, 0.0, None)) - np.where(near, 0.0, square / 2)
