"""Two agents on a line as a Markov chain on cells: dynamic programming by whole arrays in NumPy.

An agent moves by a whole number of cells, and its noise by the probabilities of the cells.  All
rules are applied to the cells as the environment applies them to states: first arrivals, then
crashes of pairs in traffic.  States of a pair are (mode, x, y): both in traffic, or one parked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

MODES = ((False, False), (True, False), (False, True))
"""Which of the agents are parked; with both the game is over."""

Costs = dict[tuple[bool, bool], np.ndarray]
"""Per mode (2, X, Y): costs to go of both agents."""


@dataclass(frozen=True)
class Line:
    """The game: cells (X,) of both agents, and its numbers.

    Attributes
    ----------
    cells : centres of the cells, evenly spaced.
    goals, moves : of both agents; moves are whole numbers of cells.
    tolerance, body, noise, lam, crash : lengths, the variance of the noise, and costs.
    stays, removes : whether arrived bodies stay, and whether crashed agents leave.
    """

    cells: np.ndarray
    goals: tuple[float, float]
    moves: tuple[np.ndarray, np.ndarray]
    tolerance: float
    body: float
    noise: float
    lam: float
    crash: float
    stays: bool
    removes: bool = True

    def after_noise(self) -> np.ndarray:
        """Return (X, X) probabilities to get from a cell to another one by the noise."""
        width = self.cells[1] - self.cells[0]
        edges = np.concatenate([[-np.inf], self.cells[1:] - width / 2, [np.inf]])
        return np.diff(ndtr((edges[None] - self.cells[:, None]) / np.sqrt(self.noise)), axis=1)

    def arrived(self, agent: int) -> np.ndarray:
        """Return (X,) whether the cells are in the agent's arrival region."""
        return np.abs(self.cells - self.goals[agent]) <= self.tolerance

    def outcome(self, mode: tuple[bool, bool], later: Costs) -> np.ndarray:
        """Return (2, X, Y) costs at the states after the noise, given those of later steps."""
        X, apart = len(self.cells), np.abs(self.cells[:, None] - self.cells[None])
        first = np.broadcast_to(mode[0] | self.arrived(0)[:, None], (X, X))
        second = np.broadcast_to(mode[1] | self.arrived(1)[None], (X, X))
        cost = np.zeros((2, X, X))
        for ends in MODES:
            here = (first == ends[0]) & (second == ends[1])
            cost += here * later[ends]
        counts = ~(first & second) if self.stays else ~(first | second)
        touch = (apart < self.body - 1e-9) / 2 + (apart <= self.body + 1e-9) / 2
        return np.asarray(cost + counts * touch * (self.crash - cost * self.removes))


def _shifted(values: np.ndarray, move: int, axis: int) -> np.ndarray:
    """Return ``values`` at the cells ``move`` further along; the last cell continues."""
    at = np.clip(np.arange(values.shape[axis]) + move, 0, values.shape[axis] - 1)
    return np.take(values, at, axis=axis)


def solve(
    line: Line, steps: int, weights: tuple[float, float] = (1.0, 1.0),
    given: dict[int, Callable[[np.ndarray], np.ndarray]] | None = None,
) -> Costs:  # fmt: skip
    """Return costs when both agents minimise the ``weights``-ed sum of costs.

    Agent i moves by ``given[i](cells)`` cells instead if there is such a function.
    """
    noise, X = line.after_noise(), len(line.cells)
    later: Costs = {mode: np.zeros((2, X, X)) for mode in MODES}
    for _ in range(steps):
        now: Costs = {}
        for mode in MODES:
            cost = line.outcome(mode, later)
            if not mode[0]:
                cost = noise @ cost
            if not mode[1]:
                cost = cost @ noise.T
            for axis in (1, 0):
                if mode[axis]:
                    continue
                if given is not None and axis in given:
                    at = np.clip(np.arange(X) + given[axis](line.cells), 0, X - 1)
                    cost = np.take(cost, at, axis=axis + 1)
                    continue
                tried = np.stack([_shifted(cost, m, axis + 1) for m in line.moves[axis]])
                best = np.tensordot(tried, weights, axes=(1, 0)).argmin(axis=0)
                cost = np.take_along_axis(tried, best[None, None], axis=0)[0]
            now[mode] = cost + line.lam * ~np.array(mode)[:, None, None]
        later = now
    return later
