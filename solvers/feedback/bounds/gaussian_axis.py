r"""Expectations of piecewise linear functions of one coordinate after a step of Gaussian noise.

For nodes x_0 < x_1 < ..., ``h`` apart, and w ~ N(0, sigma^2), row m of a matrix holds the
expectations of the hat functions of all nodes at x_m + w, or their derivatives in x_m.  With
z = (y - x_m) / sigma, a derivative of order k multiplies the density by He_k(z) / sigma^k, so all
of them follow from the moments of z over the segments between nodes, which have closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

ABSOLUTE_HERMITE = (1.0, 0.79789, 0.96789, 1.51013, 2.80061)
"""E|He_k(z)| of a standard normal z, k = 0..4, rounded up."""


@dataclass(frozen=True)
class Axis:
    """Nodes of one coordinate.

    Attributes
    ----------
    low, spacing, count : the nodes are low + spacing j, j < count.
    sigma : standard deviation of the noise, positive.
    region : the first and the last node of the arrival region; None if it does not bound this
        coordinate.
    """

    low: float
    spacing: float
    count: int
    sigma: float
    region: tuple[int, int] | None

    @property
    def nodes(self) -> np.ndarray:
        """(n,) positions."""
        return self.low + self.spacing * np.arange(self.count)

    @cached_property
    def everywhere(self) -> list[np.ndarray]:
        """Matrices (n, n) of orders 0, 1, 2, of the functions on all segments."""
        return self._matrices(self.nodes, self.sigma, slice(None))

    @cached_property
    def arrived(self) -> list[np.ndarray]:
        """Matrices (n, n) of orders 0, 1, 2, of the functions in the arrival region."""
        if self.region is None:
            return self.everywhere
        return self._matrices(self.nodes, self.sigma, slice(*self.region))

    def start(self, mean: float, sigma: float, *, arrived: bool) -> np.ndarray:
        """Return (n,) expectations of the hat functions at one ``mean``, with its own deviation."""
        if sigma == 0.0:
            place = (mean - self.low) / self.spacing
            hats = np.maximum(0.0, 1.0 - np.abs(place - np.arange(self.count)))
            inside = self.region is None or self.region[0] <= place <= self.region[1]
            return hats if inside or not arrived else np.zeros(self.count)
        part = slice(*self.region) if arrived and self.region is not None else slice(None)
        return self._matrices(np.array([mean]), sigma, part)[0][0]

    def _matrices(self, means: np.ndarray, sigma: float, part: slice) -> list[np.ndarray]:
        from scipy.special import erfc

        ends = (self.nodes - means[:, None]) / sigma
        density = np.exp(-(ends**2) / 2) / np.sqrt(2 * np.pi)
        a, b = ends[:, :-1], ends[:, 1:]
        pa, pb = density[:, :-1], density[:, 1:]
        flip = np.where(a + b > 0, -1.0, 1.0)  # differences of left tails are exact
        tails = [erfc(-flip * end / np.sqrt(2)) / 2 for end in (a, b)]
        moments = [flip * (tails[1] - tails[0]), pa - pb]
        moments.append(moments[0] + a * pa - b * pb)
        moments.append(2 * moments[1] + a**2 * pa - b**2 * pb)
        orders = [
            (moments[0], moments[1]),
            (moments[1] / sigma, moments[2] / sigma),
            ((moments[2] - moments[0]) / sigma**2, (moments[3] - moments[1]) / sigma**2),
        ]
        keep = np.zeros(self.count - 1)
        keep[part] = 1.0
        matrices = []
        for constant, linear in orders:
            right = (-a * constant + linear) * (sigma / self.spacing) * keep
            matrix = np.zeros((len(means), self.count))
            matrix[:, 1:] += right
            matrix[:, :-1] += constant * keep - right
            matrices.append(matrix)
        return matrices


@dataclass(frozen=True)
class NoAxis:
    """The second coordinate of a problem on a line: one node, no noise."""

    low: float = 0.0
    spacing: float = 1.0
    count: int = 1
    sigma: float = 1.0
    region: tuple[int, int] | None = None

    @property
    def nodes(self) -> np.ndarray:
        """(1,) zero."""
        return np.zeros(1)

    @property
    def everywhere(self) -> list[np.ndarray]:
        """The identity, whose derivatives are zero."""
        return [np.ones((1, 1)), np.zeros((1, 1)), np.zeros((1, 1))]

    @property
    def arrived(self) -> list[np.ndarray]:
        """The same: arrival does not depend on this coordinate."""
        return self.everywhere

    def start(self, mean: float, sigma: float, *, arrived: bool) -> np.ndarray:
        """Return one."""
        return np.ones(1)
