r"""Bounds on an agent's mean at each time, for a given arrival.

    forward     max a.r_t  over controls from the start
    backward    max a.r_t  over controls that still bring it to the goal in T - t steps

Both bound the same plans, so the smaller one holds.  The backward bound needs an invertible A and
a goal that fixes the whole state; otherwise the forward bound is used alone.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.reachability import BackwardReach, reach_upper


class Reach:
    """Bounds of a.r_t for the rows of ``directions`` (F, d), positions of one agent.

    From its arrival on, the agent is at its goal.
    """

    def __init__(self, agent: Agent, directions: np.ndarray, horizon: int) -> None:
        padding = np.zeros((len(directions), agent.state_dim - directions.shape[1]))
        rows = np.hstack([directions, padding])
        both = np.vstack([rows, -rows])
        self._count = len(rows)
        self._goal = directions @ agent.goal[: directions.shape[1]]
        self._forward = reach_upper(agent, both, horizon)
        has_backward = BackwardReach.exists(agent)
        self._backward = BackwardReach(agent, both, horizon) if has_backward else None
        self._bounds: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def bounds(self, arrival: int, instants: int) -> tuple[np.ndarray, np.ndarray]:
        """Return (instants, F) lowest and highest a.r_t for t = 0..instants - 1."""
        low, high = self._moving(arrival)
        parked = instants - arrival
        if parked <= 0:
            return low[:instants], high[:instants]
        rest = np.broadcast_to(self._goal, (parked, self._count))
        return np.concatenate([low, rest]), np.concatenate([high, rest])

    def _moving(self, arrival: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the bounds (arrival, F) before the arrival, cached."""
        if arrival not in self._bounds:
            upper = self._forward[:arrival]
            if self._backward is not None:
                upper = np.minimum(upper, self._backward.upper(arrival)[:-1])
            self._bounds[arrival] = -upper[:, self._count :], upper[:, : self._count]
        return self._bounds[arrival]

    def anywhere(
        self, latest: int, instants: int, after: int | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return (instants, F) lowest and highest a.r_t over all arrivals up to ``latest``.

        The agent counts for ``after`` instants from its arrival on (None: all of them).
        """
        low = np.full((instants, self._count), np.inf)
        high = -low
        for arrival in range(latest + 1):
            count = instants if after is None else min(arrival + after, instants)
            below, above = self.bounds(arrival, count)
            low[:count] = np.minimum(low[:count], below)
            high[:count] = np.maximum(high[:count], above)
        return low, high


@lru_cache(maxsize=512)
def reach_of(agent: Agent, normals: tuple[tuple[float, ...], ...], horizon: int) -> Reach:
    """Return the cached :class:`Reach` of an agent along ``normals``."""
    return Reach(agent, np.array(normals), horizon)
