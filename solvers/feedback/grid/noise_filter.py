"""Expectations over the noise of one agent, as sparse filters on its grid.

For f given on the grid and a state y on the grid before the noise, the filters give
E[f(y + w)] and E[1{y + w in the arrival region} f(y + w)].  With noise that is independent over
axes both are products of one filter per axis; other noise has one filter over the plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import prange

from ppg_env.errors import require
from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import square_root
from ppg_env.support.compilation import njit
from solvers.feedback.grid.cubic import gaussian_weights, keys_weights
from solvers.feedback.grid.state_grid import AXES, Grid

SMALLEST = 1e-9
"""Weights below this are dropped."""

NODES = 160
"""Nodes per axis of the quadrature of correlated noise."""


@dataclass(frozen=True)
class Factor:
    """A sparse matrix that acts on one axis, or on all, of values on a grid.

    Attributes
    ----------
    first, index, weight : rows of the matrix, as in compressed sparse rows.
    inner : number of grid points per step along the axis.
    """

    first: np.ndarray
    index: np.ndarray
    weight: np.ndarray
    inner: int

    def __call__(self, values: np.ndarray, width: int) -> np.ndarray:
        """Return the filtered ``values``, of which ``width`` lie side by side per grid point."""
        rows = self.first.size - 1
        shaped = values.reshape(-1, rows, self.inner * width)
        out = np.empty_like(shaped)
        _filter(self.first, self.index, self.weight, shaped, out)
        return out.reshape(values.shape)


def _factor(matrix: np.ndarray, inner: int) -> Factor:
    from scipy.sparse import csr_matrix

    rows = csr_matrix(np.where(np.abs(matrix) > SMALLEST, matrix, 0.0))
    return Factor(rows.indptr, rows.indices, rows.data.astype(np.float32), inner)


@dataclass(frozen=True)
class NoiseFilter:
    """Filters over the noise of an agent, and the probability that it does not arrive.

    Attributes
    ----------
    everywhere, arrival : factors of E[f] and of E[1{arrival} f].
    stays : (K,) probability that the agent is not in its arrival region after the noise.
    """

    everywhere: Sequence[Factor]
    arrival: Sequence[Factor]
    stays: np.ndarray

    def traffic(self, values: np.ndarray, width: int = 1) -> np.ndarray:
        """Return E[1{no arrival} f] for values (..., K, width)."""
        total = values
        for factor in self.everywhere:
            total = factor(total, width)
        return total - self.arrives(values, width)

    def arrives(self, values: np.ndarray, width: int = 1) -> np.ndarray:
        """Return E[1{arrival} f] for values (..., K, width)."""
        for factor in self.arrival:
            values = factor(values, width)
        return values


def make_noise_filter(mover: Agent, grid: Grid, tolerance: np.ndarray) -> NoiseFilter:
    """Return the filters of ``mover`` on its grid; it arrives within ``tolerance`` of its goal.

    ``tolerance`` has one number per component of the goal.
    """
    n, goal = mover.state_dim, mover.goal
    region = [
        (goal[k] - tolerance[k], goal[k] + tolerance[k]) if k < goal.size else (-np.inf, np.inf)
        for k in range(len(grid.shape))
    ]
    if np.array_equal(mover.noise, np.diag(np.diag(mover.noise))):
        deviations = np.sqrt(np.pad(np.diag(mover.noise), (0, len(grid.shape) - n)))
        everywhere, arrival = _separable(grid, deviations, region)
    else:
        require(
            len(grid.shape) == AXES,
            "noise",
            "is correlated between state components",
            "use a diagonal covariance for an agent without others",
        )
        everywhere, arrival = _joint(grid, square_root(mover.noise), region)
    one = np.ones(grid.size, dtype=np.float32)
    made = NoiseFilter(everywhere, arrival, one)
    stays = np.clip(made.traffic(one), 0.0, 1.0).astype(np.float32)
    return NoiseFilter(everywhere, arrival, stays)


def _separable(
    grid: Grid, deviations: np.ndarray, region: Sequence[tuple[float, float]]
) -> tuple[list[Factor], list[Factor]]:
    """Return one factor per axis with more than one point."""
    everywhere: list[Factor] = []
    arrival: list[Factor] = []
    for k, size in enumerate(grid.shape):
        if size == 1:
            continue
        inner = int(np.prod(grid.shape[k + 1 :]))
        low, step = grid.low[k], grid.step[k]
        points = low + step * np.arange(size)
        for factors, within in ((everywhere, (-np.inf, np.inf)), (arrival, region[k])):
            weights = gaussian_weights(low, step, size, points, float(deviations[k]), within)
            factors.append(_factor(weights, inner))
    return everywhere, arrival


def _joint(
    grid: Grid, root: np.ndarray, region: Sequence[tuple[float, float]]
) -> tuple[list[Factor], list[Factor]]:
    """Return one factor over the plane, by quadrature over a fine lattice of standard normals."""
    from scipy.special import ndtr

    edges = np.linspace(-5.5, 5.5, NODES + 1)
    mass = np.diff(ndtr(edges))
    nodes = -np.diff(np.exp(-0.5 * edges**2)) / np.sqrt(2 * np.pi) / mass  # centres of mass
    noise = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1).reshape(-1, AXES) @ root.T
    weight = np.outer(mass, mass).ravel() / mass.sum() ** 2
    low, high = (np.array(side) for side in zip(*region, strict=True))
    matrices = np.zeros((2, grid.size, grid.size))
    _spread(grid.points, noise, weight, low, high, grid.low, grid.step, grid.shape, matrices)
    return [_factor(matrices[0], 1)], [_factor(matrices[1], 1)]


@njit(cache=True, parallel=True)
def _spread(points, noise, weight, low, high, first, step, shape, out):
    """Write both matrices (2, K, K): all of the noise, and the part that ends in the region."""
    for p in prange(points.shape[0]):
        w0, w1 = np.empty(4), np.empty(4)
        for q in range(weight.size):
            x0, x1 = points[p, 0] + noise[q, 0], points[p, 1] + noise[q, 1]
            inside = low[0] <= x0 <= high[0] and low[1] <= x1 <= high[1]
            a = min(max((x0 - first[0]) / step[0], 0.0), shape[0] - 1.0)
            b = min(max((x1 - first[1]) / step[1], 0.0), shape[1] - 1.0)
            i, j = min(int(a), max(shape[0] - 2, 0)), min(int(b), max(shape[1] - 2, 0))
            keys_weights(a - i, w0)
            keys_weights(b - j, w1)
            for r in range(4):
                row = min(max(i + r - 1, 0), shape[0] - 1) * shape[1]
                for s in range(4):
                    k = row + min(max(j + s - 1, 0), shape[1] - 1)
                    value = weight[q] * w0[r] * w1[s]
                    out[0, p, k] += value
                    if inside:
                        out[1, p, k] += value


@njit(cache=True, parallel=True, fastmath=False)
def _filter(first, index, weight, values, out):
    """Write the product of a sparse matrix with every layer of ``values`` (layers, rows, width)."""
    layers, rows, width = values.shape
    for task in prange(layers * rows):
        layer, row = task // rows, task % rows
        target = out[layer, row]
        target[:] = 0.0
        for entry in range(first[row], first[row + 1]):
            source, w = values[layer, index[entry]], weight[entry]
            for k in range(width):
                target[k] += w * source[k]
