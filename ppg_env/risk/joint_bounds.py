r"""A lower bound on the probability that two jointly Gaussian displacements both lie in their sets.

Canonical coordinates x = P' La^-1 (X - mean), y = Q' Lb^-1 (Y - mean), with La La' and Lb Lb' the
covariances and P diag(rho) Q' = La^-1 cov(X, Y) Lb^-T, are independent except for rho_k between
x_k and y_k.  Disjoint boxes a_1, a_2, ... inside the first set and b_1, ... inside the second
then give

    Pr(X in A, Y in B)  >=  sum_lm prod_k Pr(x_k in a_lk, y_k in b_mk).

Each factor is the standard normal probability of a parallelogram.  A set that is a box in these
coordinates, as every box with independent axes is, is filled by one box: the bound is exact.
"""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp

from ppg_env import tolerances as tol
from ppg_env.game.polytope import Polytope
from ppg_env.risk.overlap import is_box, surface
from ppg_env.risk.polytope_probability import log_interval, log_polygon

GRID = {
    2: (-3.5, -1.6, -0.7, -0.2, 0.0, 0.2, 0.7, 1.6, 3.5),
    3: (-2.5, -0.5, 0.0, 0.5, 2.5),
}
"""Cuts between boxes by dimension, in deviations from the point of the set nearest to the mean.
They are finer near that point, where the mass is if it is a corner."""

SAME, SLACK = 1 - 1e-12, 1e-5
"""Variables with a correlation above SAME differ by less than SLACK with probability 1 - 1e-11."""

FAINT = 9.0
"""Pairs of boxes with less than exp(-FAINT) of the best pair's largest probability are left out."""

WIDE = 40.0
"""Width of the boxes that fill quarter planes, in deviations."""

SHY = 1e-6
"""Relative reduction of every bound, well above all numerical error."""


def log_joint_bound(
    sets: tuple[Polytope, Polytope],
    means: tuple[np.ndarray, np.ndarray],
    covariances: tuple[np.ndarray, np.ndarray],
    cross: np.ndarray,
) -> np.ndarray:
    """Return (B,) lower bounds on log Pr(X in A, Y in B) for the ``sets`` A and B.

    Parameters
    ----------
    means, covariances
        (B, d) and (B, d, d) of X and of Y; the covariances have full rank.
    cross
        (B, d, d) covariance of X with Y.
    """
    inverses = [np.linalg.inv(np.linalg.cholesky(matrix)) for matrix in covariances]
    left, rho, right = np.linalg.svd(inverses[0] @ cross @ _transposed(inverses[1]))
    maps = [_transposed(left) @ inverses[0], right @ inverses[1]]
    free = np.ptp(rho, axis=1) <= tol.FACE  # the same rotation of both then changes nothing
    if free.any():
        turn = _to_best_face(sets[0], means[0], maps[0])
        turn[~free] = np.eye(sets[0].dim)
        maps = [turn @ matrix for matrix in maps]
    (low, high), (below, above) = (
        _inner_boxes(*arguments) for arguments in zip(sets, means, maps, strict=True)
    )
    pairs = (low[:, :, None], high[:, :, None], below[:, None], above[:, None])
    low, high, below, above = np.broadcast_arrays(*pairs)  # (B, boxes of A, boxes of B, d)
    kept = ((low < high) & (below < above)).all(axis=-1)
    most = np.minimum(log_interval(low, high), log_interval(below, above)).sum(axis=-1)
    kept &= most >= most.max(axis=(1, 2), keepdims=True) - FAINT
    total = np.full(kept.shape, -np.inf)
    strength = np.broadcast_to(rho[:, None, None], low.shape)[kept]
    factors = _log_rectangle(strength, low[kept], high[kept], below[kept], above[kept])
    total[kept] = factors.sum(axis=-1)
    return logsumexp(total, axis=(1, 2)) + np.log1p(-SHY)


def log_joint_tails(rho: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return (B,) lower bounds on log Pr(x <= -first, y <= -second).

    x and y are standard normals with correlation ``rho`` (B,).
    """
    low, below = -np.maximum(first, 0.0) - WIDE, -np.maximum(second, 0.0) - WIDE
    return _log_rectangle(rho, low, -first, below, -second) + np.log1p(-SHY)


def _log_rectangle(
    rho: np.ndarray, low: np.ndarray, high: np.ndarray, below: np.ndarray, above: np.ndarray
) -> np.ndarray:
    """Return (...,) log of Pr(low < x < high, below < y < above).

    x and y are standard normals with correlation ``rho``.  With y = rho x + sqrt(1 - rho^2) v, the
    pair (x, v) is standard normal.
    """
    same = rho > SAME
    rest = np.sqrt(1 - np.where(same, 0.0, rho) ** 2)
    x = np.stack([low, high, high, low], axis=-1)
    y = np.stack([below, below, above, above], axis=-1)
    v = (y - rho[..., None] * x) / rest[..., None]
    apart = log_polygon(np.stack([x, v], axis=-1).reshape(-1, 4, 2)).reshape(rho.shape)
    shared = log_interval(np.maximum(low, below) + SLACK, np.minimum(high, above) - SLACK)
    return np.where(same, shared, apart)


def _to_best_face(body: Polytope, means: np.ndarray, maps: np.ndarray) -> np.ndarray:
    """Return (B, d, d) reflections that map the normal of the best face to an axis."""
    normals, rooms = _faces(body, means, maps)
    axis = np.take_along_axis(normals, rooms.argmin(axis=1)[:, None, None], axis=1)[:, 0]
    target = np.eye(body.dim)[np.abs(axis).argmax(axis=1)]  # the nearest axis
    target = target * np.sign((axis * target).sum(axis=1))[:, None]
    mirror = axis - target
    length = (mirror**2).sum(axis=1)[:, None, None]
    outer = mirror[:, :, None] * mirror[:, None, :]
    return np.eye(body.dim) - np.divide(
        2 * outer, length, out=np.zeros_like(outer), where=length > 0
    )


def _faces(body: Polytope, means: np.ndarray, maps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit normals (B, F, d) and distances (B, F) of faces after x = map (X - mean)."""
    normals = body.normals @ np.linalg.inv(maps)
    rooms = body.offsets - means @ body.normals.T
    length = np.linalg.norm(normals, axis=-1)
    return normals / length[..., None], rooms / length


def _inner_boxes(
    body: Polytope, means: np.ndarray, maps: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return corners low and high (B, M, d) of disjoint boxes inside the image of a set.

    The boxes are columns along the first axis over the cells of a grid, cut where all corners of
    the cell are inside; by convexity the column is inside too.  Boxes with low >= high are empty.
    """
    corners = (body.vertices - means[:, None]) @ _transposed(maps)
    normals, rooms = _faces(body, means, maps)
    bottom, top = corners.min(axis=1), corners.max(axis=1)
    if all(map(is_box, normals)):
        return bottom[:, None], top[:, None]
    cuts = np.array(GRID[body.dim])[:, None] + _nearest(body, corners, normals, rooms)[:, None, 1:]
    cuts = np.clip(cuts, bottom[:, None, 1:], top[:, None, 1:])  # (B, G, d - 1)
    batch, count, across = cuts.shape
    start, end = _chords(normals, rooms, _lattice(cuts))
    start, end = (ends.reshape(batch, *[count] * across) for ends in (start, end))
    before, after = np.arange(count - 1), np.arange(1, count)
    for axis in range(1, across + 1):  # the most restrictive corner of each cell
        start = np.maximum(start.take(before, axis), start.take(after, axis))
        end = np.minimum(end.take(before, axis), end.take(after, axis))
    low = [start.reshape(batch, -1, 1), _lattice(cuts[:, :-1])]
    high = [end.reshape(batch, -1, 1), _lattice(cuts[:, 1:])]
    return np.concatenate(low, axis=2), np.concatenate(high, axis=2)


def _lattice(cuts: np.ndarray) -> np.ndarray:
    """Return (B, G^k, k) all points whose coordinates are in ``cuts`` (B, G, k)."""
    count, across = cuts.shape[1:]
    index = np.indices([count] * across).reshape(across, -1)
    return np.stack([cuts[:, index[k], k] for k in range(across)], axis=-1)


def _chords(
    normals: np.ndarray, rooms: np.ndarray, places: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return where lines along the first axis at ``places`` (B, P, d - 1) enter and leave a set.

    For a line that misses the set, the start is beyond the end.
    """
    slope = normals[:, None, :, 0]
    left = rooms[:, None] - places @ _transposed(normals[..., 1:])  # (B, P, F)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ends = left / slope
    start = np.where(slope < 0, ends, -np.inf).max(axis=-1)
    end = np.where(slope > 0, ends, np.inf).min(axis=-1)
    outside = ((slope == 0) & (left < 0)).any(axis=-1)
    return np.where(outside, np.inf, start), end


def _nearest(
    body: Polytope, corners: np.ndarray, normals: np.ndarray, rooms: np.ndarray
) -> np.ndarray:
    """Return (B, d) the point of a set nearest to the origin, approximately."""
    count = np.arange(len(corners[0]))
    rims = np.column_stack([count, np.roll(count, -1)]) if body.dim == 2 else surface(body)[:, :2]
    first, second = corners[:, rims[:, 0]], corners[:, rims[:, 1]]
    along = second - first
    share = -(first * along).sum(axis=-1) / (along**2).sum(axis=-1)
    feet = first + np.clip(share, 0.0, 1.0)[..., None] * along
    best = (feet**2).sum(axis=-1).argmin(axis=1)[:, None, None]
    edge = np.take_along_axis(feet, best, axis=1)[:, 0]
    face = rooms.argmin(axis=1)[:, None]
    depth = np.minimum(np.take_along_axis(rooms, face, axis=1), 0.0)
    foot = depth * np.take_along_axis(normals, face[..., None], axis=1)[:, 0]
    inside = (np.einsum("bfk,bk->bf", normals, foot) <= rooms + tol.LENGTH).all(axis=1)
    return np.where(inside[:, None], foot, edge)


def _transposed(matrices: np.ndarray) -> np.ndarray:
    return np.swapaxes(matrices, -1, -2)
