r"""The problem of one agent alone on a grid, and the rim of that grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.feedback.bounds.gaussian_axis import Axis, NoAxis

FAR = 9.0
"""Noise beyond so many deviations has a probability below 1e-18, which ``ROUNDING`` covers."""


@dataclass(frozen=True, eq=False)
class SoloProblem:
    """One agent alone, in units of the cost of a step.

    Attributes
    ----------
    A : (2, 2) dynamics; on a line, the second row and column are zero.
    moves : the corners (V, 2) of B U and the first step from which that set holds, in order.
    slopes : (K, 2) tangents q of the effort, q B u <= f |u|_1.
    axes : the grid.
    leave : cost of leaving at once.
    steps : largest number of steps.
    pulls : (K, 2) vectors l with l B u <= 1 for all inputs; none unless A = I.
    short : (K,) the steps s at x = 0.
    inside : value in the region, zero for arrival.
    """

    A: np.ndarray
    moves: tuple[tuple[int, np.ndarray], ...]
    slopes: np.ndarray
    axes: tuple[Axis, Axis | NoAxis]
    leave: float
    steps: int
    pulls: np.ndarray
    short: np.ndarray
    inside: float = 0.0

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of nodes."""
        return self.axes[0].count, self.axes[1].count

    @property
    def spacing(self) -> np.ndarray:
        """(2,) distances of nodes; zero for a component that is not there."""
        x, y = self.axes
        return np.array([x.spacing, 0.0 if isinstance(y, NoAxis) else y.spacing])

    @property
    def size(self) -> int:
        """Number of components."""
        return 1 if isinstance(self.axes[1], NoAxis) else 2

    @property
    def still(self) -> bool:
        """Whether the state rests without inputs, A = I."""
        return np.array_equal(self.A[: self.size, : self.size], np.eye(self.size))

    @property
    def region(self) -> np.ndarray:
        """Whether a node is in the region, its sides included."""
        inside = np.zeros(self.shape, dtype=bool)
        spans = [
            slice(None) if axis.region is None else slice(axis.region[0], axis.region[1] + 1)
            for axis in self.axes
        ]
        inside[tuple(spans)] = True
        return inside


class Rim:
    """Which nodes of a grid can be left in a step, and which can be entered from outside."""

    def __init__(self, problem: SoloProblem) -> None:
        self._problem = problem
        self._spacing, self._shape = problem.spacing, problem.shape

    @cached_property
    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest position on the grid; a coordinate that is not there has no ends."""
        axes = self._problem.axes
        low, high = (np.array([axis.nodes[k] for axis in axes]) for k in (0, -1))
        absent = self._spacing == 0.0
        return np.where(absent, -np.inf, low), np.where(absent, np.inf, high)

    def _leaves(self, M: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return whether some point of M x + [low, high] is off the grid, at every node x."""
        x, y = (axis.nodes for axis in self._problem.axes)
        rim = 2 * (self._spacing + np.abs(M) @ self._spacing)
        off = np.zeros(self._shape, dtype=bool)
        for a in range(2):
            place = np.add.outer(M[a, 0] * x, M[a, 1] * y)
            off |= place + low[a] - rim[a] < self._ends[0][a]
            off |= place + high[a] + rim[a] > self._ends[1][a]
        return off

    def left(self, corners: np.ndarray) -> np.ndarray:
        """Return the nodes from which a decision leads off the grid."""
        return self._leaves(self._problem.A, corners.min(axis=0), corners.max(axis=0))

    def entered(self, corners: np.ndarray) -> np.ndarray:
        """Return the nodes that a step from outside, or noise alone, can enter."""
        size = self._problem.size
        block = self._problem.A[:size, :size]
        noise = FAR * np.array([axis.sigma for axis in self._problem.axes])
        near = self._leaves(np.eye(2), -noise, noise)
        if np.linalg.cond(block) > 1e8:
            return np.ones(self._shape, dtype=bool)
        back = np.zeros((2, 2))
        back[:size, :size] = np.linalg.inv(block)
        ends = np.array([-noise - corners.max(axis=0), noise - corners.min(axis=0)])
        spans = np.sort(back[:, :, None] * ends.T[None, :, :], axis=2).sum(axis=1)
        return near | self._leaves(back, spans[:, 0], spans[:, 1])

    def reachable(self, corners: np.ndarray) -> bool:
        """Return whether a step from outside may arrive."""
        unbounded = any(
            axis.region is None and self._spacing[a] > 0.0
            for a, axis in enumerate(self._problem.axes)
        )
        return unbounded or bool((self._problem.region & self.entered(corners)).any())
