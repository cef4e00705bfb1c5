r"""The game of the displacement of two agents as tables, see :mod:`.pair_bound`."""

from __future__ import annotations

import numpy as np

from ppg_env.game.polytope import Polytope
from solvers.feedback.bounds.grid_rim import SoloProblem
from solvers.feedback.bounds.pair_terms import Mover, Rest
from solvers.feedback.bounds.solo_grid import ROUNDING, SoloGrid
from solvers.feedback.bounds.solo_table import make_axis

NODES_PER_DEVIATION = 5.0
"""Nodes of the displacement's grid per standard deviation of its noise."""

MARGIN = 3
"""Steps by which the displacement's grid exceeds the way of the two."""


class PairGrid(SoloGrid):
    """Tables of the displacement's game."""

    def __init__(
        self,
        movers: tuple[Mover, Mover],
        collision: Polytope,
        hit: float,
        time: int,
        touch: float,
    ) -> None:
        first, second = movers
        sums = (first.moves[:, None] - second.moves[None]).reshape(-1, 2)
        self._corners = Polytope("vertices", (sums,)).vertices
        self._movers, self._hit = movers, hit
        self._start = first.agent.start - second.agent.start
        sigma = np.hypot(first.sigma, second.sigma)
        low, high = collision.bounds
        centre, half = (low + high) / 2, (high - low) / 2
        room = (collision.offsets - collision.normals @ centre) / (np.abs(collision.normals) @ half)
        half = half * max(float(room.min()), 0.0) - touch
        away = np.abs(self._corners).max(axis=0)
        best = [mover.moves[(mover.moves @ mover.pull).argmax()] for mover in movers]
        end = self._start + time * (best[0] - best[1])
        axes = []
        for a in range(2):
            ends = [self._start[a], end[a], low[a], high[a]]
            span = min(ends) - MARGIN * away[a], max(ends) + MARGIN * away[a]
            spacing = sigma[a] / NODES_PER_DEVIATION
            axes.append(make_axis(span, float(centre[a]), float(half[a]), spacing, float(sigma[a])))
        problem = SoloProblem(
            A=np.eye(2),
            moves=((0, self._corners),),
            slopes=np.zeros((1, 2)),
            axes=(axes[0], axes[1]),
            leave=hit,
            steps=time,
            pulls=np.zeros((0, 2)),
            short=np.zeros(0),
            inside=hit,
        )
        super().__init__(problem)

    def solve_pair(self, first: Rest, second: Rest, time: int) -> tuple[float, float]:
        """Return P_0 at the start, and the most of P."""
        value = np.full(self._shape, -np.inf)
        for a in range(2):
            line = self._convolved(a, first, second)
            np.maximum(value, line[:, None] if a == 0 else line[None, :], out=value)
        value = np.minimum(value, self._hit)
        floor = min(float(value.min()), 0.0)
        for _ in range(time):
            value = self._earlier(value, floor)
            floor -= ROUNDING * (1.0 + self._hit)
        rows = [
            axis.start(self._start[a], 0.0, arrived=False)
            for a, axis in enumerate(self._problem.axes)
        ]
        return float(rows[0] @ value @ rows[1]), max(self._hit, float(value.max()))

    def _earlier(self, value: np.ndarray, floor: float) -> np.ndarray:
        """Return the table one step earlier; ``floor`` bounds P off the grid."""
        within = self.after(value, floor)
        first, second = self._movers
        best = np.full(self._shape, -np.inf)
        for tangent in self._tangents():
            ways = (first.moves @ (first.pull + tangent)).max()
            ways += (second.moves @ (second.pull - tangent)).max()
            cost = first.agent.lam + second.agent.lam - float(ways)
            np.maximum(best, self.least(within, self._corners, tangent) + cost, out=best)
        rim = self.rim.left(self._corners)
        best[rim] = np.minimum(best[rim], floor)
        return np.minimum(best, self._hit) - ROUNDING * (1.0 + self._hit)

    def _tangents(self) -> np.ndarray:
        """Return slopes of tangents to the least cost of a displacement's step."""
        first, second = (mover.pull for mover in self._movers)
        shares = (0.0, 0.5, 1.0)
        return np.unique([q * second - p * first for p in shares for q in shares], axis=0)

    def _convolved(self, a: int, first: Rest, second: Rest) -> np.ndarray:
        """Return (n,) bounds around each node on first(z) + second(z - D_a), over z."""
        axis = self._problem.axes[a]
        widths = [float(rest.places[a][1] - rest.places[a][0]) for rest in (first, second)]
        gaps = np.subtract.outer(first.places[a], second.places[a])
        sums = np.add.outer(first.least[a], second.least[a])
        low = np.ceil((gaps - widths[1] - axis.low) / axis.spacing - 1).astype(int)
        high = np.floor((gaps + widths[0] - axis.low) / axis.spacing + 1).astype(int)
        line = np.full(axis.count, np.inf)
        for k in range(int((high - low).max()) + 1):
            place = np.minimum(low + k, high)
            on = (place >= 0) & (place < axis.count)
            np.minimum.at(line, place[on], sums[on])
        known = np.isfinite(line)
        most = float(line[known].max()) if known.any() else 0.0
        return np.where(known, line, most)
