"""Equal boxes that cover a part of space, and sets of them as masks."""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.polytope import Polytope

SLACK = 2 * tol.LENGTH
"""Bodies may overlap and goals be missed by ``tol.LENGTH``: cells count as blocked, and as away
from a point, with room to spare."""


class Cells:
    """Equal boxes that cover a box, with the masks of those inside convex sets."""

    def __init__(self, low: np.ndarray, size: np.ndarray, shape: tuple[int, ...]) -> None:
        self.low, self.size, self.shape = low, size, shape

    @classmethod
    def covering(cls, low: np.ndarray, high: np.ndarray, size: np.ndarray) -> Cells:
        """Return cells of a ``size`` (d,) that cover a box."""
        counts = np.maximum(np.ceil((high - low) / size - 1e-9), 1).astype(int)
        return cls((low + high - counts * size) / 2, size, tuple(counts.tolist()))

    @classmethod
    def around(
        cls, centre: np.ndarray, low: np.ndarray, high: np.ndarray, size: np.ndarray
    ) -> Cells:
        """Return cells of a ``size`` (d,) that cover a box, one of them around ``centre``."""
        before = np.ceil((centre - low) / size - 0.5)
        counts = before + np.maximum(np.ceil((high - centre) / size - 0.5), 0) + 1
        return cls(centre - (before + 0.5) * size, size, tuple(counts.astype(int).tolist()))

    def centres(self, cells: np.ndarray) -> np.ndarray:
        """Return the centres (K, d) of ``cells`` (K, d)."""
        return self.low + (cells + 0.5) * self.size

    def window(self, low: np.ndarray, high: np.ndarray) -> tuple[slice, ...]:
        """Return the cells that meet a box."""
        first = np.floor((low - self.low) / self.size).astype(int)
        last = np.floor((high - self.low) / self.size).astype(int) + 1
        ends = zip(first.clip(0, self.shape), last.clip(0, self.shape), strict=True)
        return tuple(slice(int(a), int(b)) for a, b in ends)

    def near(self, point: np.ndarray) -> np.ndarray:
        """Return the mask of the cells that meet the neighbourhood of a point."""
        result = np.zeros(self.shape, dtype=bool)
        result[self.window(point - SLACK, point + SLACK)] = True
        return result

    def beyond(self, normals: np.ndarray, limits: np.ndarray) -> np.ndarray:
        """Return the mask of the cells wholly outside { x : normals x <= limits }."""
        result = np.zeros(self.shape, dtype=bool)
        everywhere = tuple(slice(0, count) for count in self.shape)
        high = self.low + np.array(self.shape) * self.size
        most = np.maximum(normals * self.low, normals * high).sum(axis=1)
        for normal, limit, largest in zip(normals, limits.tolist(), most.tolist(), strict=True):
            if largest <= limit + SLACK:
                continue
            result |= self.along(normal, everywhere, -1) > limit + SLACK
        return result

    def block(
        self, blocked: np.ndarray, collision: Polytope, shifts: np.ndarray, part: float
    ) -> None:
        """Mark the cells inside a collision set at each of ``shifts`` (K, d).

        Wholly inside, if ``part`` is 1; 0 stands for the centre, and 0.5 for half of the cell.
        """
        low, high = collision.bounds
        window = self.window(low + shifts.max(axis=0), high + shifts.min(axis=0))
        if any(part.start >= part.stop for part in window):
            return
        inside = np.ones(tuple(part.stop - part.start for part in window), dtype=bool)
        for normal, offset in zip(*collision.faces, strict=True):
            limit = float(offset + (shifts @ normal).min()) - SLACK
            inside &= self.along(normal, window, part) < limit
        blocked[window] |= inside

    def along(self, normal: np.ndarray, window: tuple[slice, ...], side: float) -> np.ndarray:
        """Return the largest (``side`` 1) or smallest (-1) normal . x in each cell of a window."""
        total = np.zeros(())
        for k, part in enumerate(window):
            centres = self.low[k] + (np.arange(part.start, part.stop) + 0.5) * self.size[k]
            total = np.add.outer(total, normal[k] * centres)
        return total + side * float(np.abs(normal) @ self.size) / 2


def connected(seeds: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the ``free`` cells that are connected to a free one of ``seeds``, corners included."""
    from scipy.ndimage import binary_propagation

    everywhere = np.ones((3,) * free.ndim, dtype=bool)
    return np.asarray(binary_propagation(seeds & free, everywhere, mask=free), dtype=bool)


def dilated(mask: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Return the sums of places of ``mask`` and displacements of ``kernel``, within the mask."""
    from scipy.fft import irfftn, next_fast_len, rfftn

    result = np.zeros_like(mask)
    places = np.argwhere(mask)
    if not len(places):
        return result
    first, last = places.min(axis=0), places.max(axis=0) + 1
    part = mask[tuple(slice(a, b) for a, b in zip(first, last, strict=True))]
    shape = [a + b - 1 for a, b in zip(part.shape, kernel.shape, strict=True)]
    fast = [next_fast_len(count, real=True) for count in shape]
    product = rfftn(part.astype(np.float32), fast) * rfftn(kernel.astype(np.float32), fast)
    sums = irfftn(product, fast) > 0.5
    corner = first - np.array(kernel.shape) // 2
    low, high = corner.clip(0), np.minimum(corner + shape, mask.shape)
    target = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    result[target] = sums[
        tuple(slice(a - c, b - c) for a, b, c in zip(low, high, corner, strict=True))
    ]
    return result
