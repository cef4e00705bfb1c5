r"""A proved lower bound on the cost of one agent alone, by dynamic programming on a grid.

With V the least expected cost to go, G the arrival region and w ~ N(0, diag sigma^2),

    W(m) = E[V'(m + w); m + w not in G],   V(x) = min(leave, 1 + min_u (W(A x + B u) + f |u|_1)),

V' that of the next step and ``leave`` the cost of leaving at once: what another agent can do to the
one that is alone in this problem is to end it, at the cost of a crash.  After the last step V is 0.

A table v stands for the lower bound of V that is bilinear between nodes.  It is a bound because

* W is computed exactly for that function: it is piecewise bilinear, with a jump at the region,
  whose sides are lines of nodes;
* the second derivatives of W are computed at the nodes as well, and bounded between them by its
  fourth ones, which the oscillation of V' within ``WINDOW`` deviations bounds;
* where W bends upwards it may be below what interpolates it, between nodes by at most

      1/8 (hx^2 Wxx+ + hy^2 Wyy+ + 2 hx hy |Wxy|)       on triangles,
      1/8 (hx^2 Wxx+ + hy^2 Wyy+)                       for the bilinear interpolant of V,

  which is subtracted; a minimum over u of functions that bend downwards does no harm;
* the minimum over A x + B U is that of :mod:`solvers.feedback.bounds.polygon_minimum`;
* effort counts by its tangents q u <= |u|_1, each with a minimum of its own;
* outside the grid one number bounds V: 1 plus the least value of a rim from which, or from outside,
  a step can end; nodes that can be left have at most that value;
* where the inputs move the state of A = I by l B u <= 1 at most, with s the number of steps that
  l x is short of the region and k those to go, for any b > 0

      V >= -1/b log(exp(-b s) + exp(-b k) + exp(-b leave)) - k b Var(l w) / 8,

  by concavity; nodes take this where all their neighbours gain by it, most of them near the rim;
* ``ROUNDING`` is subtracted at every step.
"""

from __future__ import annotations

import numpy as np

from solvers.feedback.bounds import polygon_minimum as compiled
from solvers.feedback.bounds.gaussian_axis import ABSOLUTE_HERMITE
from solvers.feedback.bounds.grid_rim import Rim, SoloProblem

WINDOW = 7.0
"""Deviations within which the oscillation of V is taken; the rest adds ``BEYOND`` of its range."""

BEYOND = 1e-7
"""Integral of |He_j He_k|, j + k <= 4, times the density, beyond ``WINDOW`` deviations: a bound."""

ROUNDING = 1e-9
"""Subtracted from each value at each step, times one plus the largest value."""

SHARPNESS = 0.5
"""The b of the bound far from the region."""

STILL = 1e-6
"""Values of a constant problem that grow by less than this in a step are final."""


class SoloGrid:
    """Tables of a :class:`SoloProblem`."""

    def __init__(self, problem: SoloProblem) -> None:
        self._problem = problem
        self.rim = Rim(problem)
        self._spacing, self._shape, self._region = problem.spacing, problem.shape, problem.region

    def solve(
        self, start: np.ndarray, deviation: np.ndarray, *, whole: bool = False
    ) -> tuple[float, np.ndarray]:
        """Return the bound from a start N(``start``, diag ``deviation``^2), and the table.

        With ``whole`` all steps are computed, not only those that matter at the start.
        """
        value, outside, best, result = np.zeros(self._shape), 0.0, 0.0, 0.0
        constant = self._problem.moves[-1][0]
        t = self._problem.steps
        while t > 0:
            t -= 1
            value, outside = self.step(value, outside, t)
            value = self._raised(value, self._problem.steps - t)
            result = self._at(value, start, deviation)
            if not whole and t >= constant and result - best < STILL and result > 1.0:
                t = min(t, constant)  # more steps to go do not lower the value
            best = result if t >= constant else 0.0
        return result, value

    def step(self, value: np.ndarray, outside: float, t: int) -> tuple[np.ndarray, float]:
        """Return the tables of step t from those of step t + 1."""
        problem = self._problem
        corners = [corners for first, corners in problem.moves if first <= t][-1]
        within = self.after(value, outside)
        best = np.full(self._shape, -np.inf)
        for slope in problem.slopes:
            np.maximum(best, self.least(within, corners, slope), out=best)
        rim = min(outside, float(value[self.rim.entered(corners)].min(initial=np.inf)))
        if self.rim.reachable(corners):
            rim = min(rim, 0.0)
        slack = ROUNDING * (1.0 + float(value.max()))
        best[self.rim.left(corners)] = np.minimum(best[self.rim.left(corners)], rim)
        ceiling = problem.leave
        return np.minimum(ceiling, 1.0 + best) - slack, min(ceiling, 1.0 + rim) - slack

    def _raised(self, value: np.ndarray, togo: int) -> np.ndarray:
        """Return the table, with the bound far from the region where that is higher."""
        from scipy.ndimage import binary_erosion

        problem, b = self._problem, SHARPNESS
        x, y = (axis.nodes for axis in problem.axes)
        sigma = np.array([axis.sigma for axis in problem.axes])
        around = np.ones((3, 3 if self._spacing[1] > 0.0 else 1), dtype=bool)
        ends = np.logaddexp(-b * togo, -b * problem.leave)
        for pull, short in zip(problem.pulls, problem.short, strict=True):
            steps = short - np.add.outer(pull[0] * x, pull[1] * y)
            bound = -np.logaddexp(-b * steps, ends) / b
            bound -= togo * b * float((pull**2) @ sigma**2) / 8 + ROUNDING
            chosen = binary_erosion(bound > value, around, border_value=1)
            value = np.where(chosen, bound, value)
        return value

    def _at(self, value: np.ndarray, start: np.ndarray, deviation: np.ndarray) -> float:
        """Return the expectation over the start; starts off the grid or in the region count 0."""
        rows = [
            [axis.start(start[a], deviation[a], arrived=flag) for flag in (False, True)]
            for a, axis in enumerate(self._problem.axes)
        ]
        whole, arrived = (rows[0][k] @ value @ rows[1][k] for k in (0, 1))
        return float(whole - arrived)

    def after(self, value: np.ndarray, outside: float) -> np.ndarray:
        """Return node values of a function that is below W, and below it when interpolated."""
        (hx, hy), A = self._spacing, self._problem.A
        bend = self._bends(value, outside)
        xx, xy, yy = bend
        loss = hx**2 * xx + hy**2 * yy + 2 * hx * hy * xy
        for a, h in enumerate((hx, hy)):
            p, q = A[0, a], A[1, a]
            loss += h**2 * (p**2 * xx + 2 * abs(p * q) * xy + q**2 * yy)
        return self._moment(value, outside, 0, 0) - self._spread(loss / 8)

    def _bends(
        self, value: np.ndarray, outside: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return bounds on Wxx+, |Wxy| and Wyy+ in the cells around each node."""
        hx, hy = self._spacing
        x, y = (axis.sigma for axis in self._problem.axes)
        swing = self._oscillation(value, outside)
        c = ABSOLUTE_HERMITE

        def fourth(a: int, b: int) -> np.ndarray:
            return swing * (c[a] * c[b] / (x**a * y**b))

        xx = self._moment(value, outside, 2, 0).clip(0.0)
        xx += (hx**2 * fourth(4, 0) + hy**2 * fourth(2, 2)) / 8
        if hy == 0.0:
            return xx, np.zeros(self._shape), np.zeros(self._shape)
        yy = self._moment(value, outside, 0, 2).clip(0.0)
        yy += (hx**2 * fourth(2, 2) + hy**2 * fourth(0, 4)) / 8
        xy = np.abs(self._moment(value, outside, 1, 1))
        xy += (hx**2 * fourth(3, 1) + hy**2 * fourth(1, 3)) / 8
        return xx, xy, yy

    def _oscillation(self, value: np.ndarray, outside: float) -> np.ndarray:
        """Return half the range of the next value around each node, and what lies beyond."""
        from scipy.ndimage import maximum_filter1d, minimum_filter1d

        inside = self._problem.inside
        high = np.where(self._region, np.maximum(value, inside), value)
        low = np.where(self._region, np.minimum(value, inside), value)
        for a, axis in enumerate(self._problem.axes):
            if self._spacing[a] > 0.0:
                size = 2 * (int(np.ceil(WINDOW * axis.sigma / axis.spacing)) + 2) + 1
                high = maximum_filter1d(high, size, a, mode="constant", cval=outside)
                low = minimum_filter1d(low, size, a, mode="constant", cval=outside)
        ends = outside, inside, float(value.min()), float(value.max())
        return (high - low) / 2 + BEYOND * (max(ends) - min(ends))

    def _spread(self, loss: np.ndarray) -> np.ndarray:
        """Return the largest loss near each node, as far as the image of a cell extends."""
        from scipy.ndimage import maximum_filter1d

        A = np.abs(self._problem.A)
        for a in range(2):
            if self._spacing[a] > 0.0:
                reach = int(np.ceil(A[a] @ self._spacing / self._spacing[a] - 1e-9)) + 2
                loss = maximum_filter1d(loss, 2 * reach + 1, a, mode="nearest")
        return loss

    def _moment(self, value: np.ndarray, outside: float, a: int, b: int) -> np.ndarray:
        """Return the derivative of W of orders a and b at the nodes."""
        x, y = self._problem.axes
        X, Y, GX, GY = x.everywhere[a], y.everywhere[b], x.arrived[a], y.arrived[b]
        result = X @ value @ Y.T - GX @ value @ GY.T
        whole = float(a == 0), float(b == 0)
        sides = [(X.sum(axis=1), Y.sum(axis=1)), (GX.sum(axis=1), GY.sum(axis=1))]
        goal = [
            sides[1][k] if axis.region is not None else np.full(axis.count, whole[k])
            for k, axis in enumerate(self._problem.axes)
        ]
        missing = whole[0] * whole[1] - np.outer(*sides[0])
        missing -= np.outer(*goal) - np.outer(*sides[1])
        return result + outside * missing + self._problem.inside * np.outer(*goal)

    def least(self, within: np.ndarray, corners: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """Return min over m in A x + B U of within(m) + slope (m - A x) at every node x."""
        x, y = self._problem.axes
        low, spacing = np.array([x.low, y.low]), np.array([x.spacing, y.spacing])
        A, polygon = self._problem.A, np.ascontiguousarray(corners / spacing)
        tilted = within + np.add.outer(slope[0] * x.nodes, slope[1] * y.nodes)
        result = np.empty(self._shape)
        if self._problem.still:
            compiled.minima_at_fixed_offsets(tilted, polygon, result)
        else:
            origin, step = (A @ low - low) / spacing, A * spacing / spacing[:, None]
            compiled.minima_at_images(tilted, polygon, origin, step, result)
        pull = A.T @ slope
        return result - np.add.outer(pull[0] * x.nodes, pull[1] * y.nodes)
