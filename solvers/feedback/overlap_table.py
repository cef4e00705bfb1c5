"""The probability that two bodies overlap after the noise, as a table over displacements.

Points of the table are a small part of a standard deviation apart; between them it is linear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from ppg_env.game.polytope import Polytope
from solvers.feedback.grid import AXES, padded
from solvers.feedback.sharp_events import overlap_probability

CELLS_PER_DEVIATION = 8

LARGEST = 1500
"""Most points per axis."""

FARTHEST = 7.0
"""Standard deviations beyond the collision set at which the table ends."""


@dataclass(frozen=True)
class OverlapTable:
    """Pr(mean + noise in the collision set) at means low + k step.

    Attributes
    ----------
    low, step : (2,) first point and distances; an axis that is no position has one point.
    values : (P, Q) probabilities; zero at the border.
    """

    low: np.ndarray
    step: np.ndarray
    values: np.ndarray

    def __call__(self, displacements: np.ndarray) -> np.ndarray:
        """Return the probabilities (M,) at ``displacements`` (M, 2)."""
        out = np.empty(len(displacements))
        _look_up_all(self.low, self.step, self.values, displacements, out)
        return out


def make_overlap_table(collision: Polytope, covariance: np.ndarray) -> OverlapTable:
    """Return the table for ``collision`` in one or two dimensions; ``covariance`` is (d, d)."""
    d = collision.dim
    low, high = collision.bounds
    deviation = np.sqrt(np.diag(covariance))
    low, high = low - FARTHEST * deviation - 1e-6, high + FARTHEST * deviation + 1e-6
    counts = np.minimum(
        np.ceil((high - low) / np.maximum(deviation / CELLS_PER_DEVIATION, 1e-9)), LARGEST
    ).astype(int)
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
    means = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = overlap_probability(collision, means, covariance)
    shape = (*values.shape, 1)[:AXES]
    step = np.ones(AXES)
    step[:d] = (high - low) / counts
    return OverlapTable(padded(low), step, np.ascontiguousarray(values.reshape(shape)))


@njit(cache=True, inline="always")
def look_up(low, step, values, first, second):
    """Return the table's value at the displacement (first, second), zero outside."""
    a = (first - low[0]) / step[0]
    i = int(np.floor(a))
    if a < 0.0 or i >= values.shape[0] - 1:
        return 0.0
    s = a - i
    if values.shape[1] == 1:
        return (1.0 - s) * values[i, 0] + s * values[i + 1, 0]
    b = (second - low[1]) / step[1]
    j = int(np.floor(b))
    if b < 0.0 or j >= values.shape[1] - 1:
        return 0.0
    t = b - j
    return (1.0 - s) * ((1.0 - t) * values[i, j] + t * values[i, j + 1]) + s * (
        (1.0 - t) * values[i + 1, j] + t * values[i + 1, j + 1]
    )


@njit(cache=True)
def _look_up_all(low, step, values, displacements, out):
    for k in range(out.size):
        out[k] = look_up(low, step, values, displacements[k, 0], displacements[k, 1])
