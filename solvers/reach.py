r"""Where an agent's mean can be at each time if it arrives at a given one.

    forward     max a.r_t  over controls from the start
    backward    max a.r_t  over controls that still bring it to the goal in T - t steps

Both bound the same plans, so the smaller counts.  The backward half needs an invertible A and a
goal that fixes the whole state; elsewhere the forward half stands alone.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ppg_env.dynamics import reach_upper
from ppg_env.game import Agent

WORST_CONDITION = 1e8
"""Beyond that the inverse of A is noise."""


class Reach:
    """Bounds of a.r_t for the rows of ``directions`` (F, d), positions of one agent."""

    def __init__(self, agent: Agent, directions: np.ndarray, horizon: int) -> None:
        padding = np.zeros((len(directions), agent.state_dim - directions.shape[1]))
        rows = np.hstack([directions, padding])
        both = np.vstack([rows, -rows])
        self._count = len(rows)
        self._forward = reach_upper(agent, both, horizon)
        self._backward = _backward(agent, both, horizon)

    def bounds(self, arrival: int) -> tuple[np.ndarray, np.ndarray]:
        """(arrival, F) lowest and highest a.r_t for t = 0..arrival - 1."""
        upper = self._forward[:arrival]
        if self._backward is not None:
            upper = np.minimum(upper, self._backward[arrival:0:-1])
        return -upper[:, self._count :], upper[:, : self._count]

    def anywhere(self, latest: int) -> tuple[np.ndarray, np.ndarray]:
        """(latest, F) lowest and highest a.r_t over all arrivals up to ``latest``."""
        low = np.full((latest, self._count), np.inf)
        high = -low
        for arrival in range(1, latest + 1):
            below, above = self.bounds(arrival)
            low[:arrival] = np.minimum(low[:arrival], below)
            high[:arrival] = np.maximum(high[:arrival], above)
        return low, high


def _backward(agent: Agent, directions: np.ndarray, horizon: int) -> np.ndarray | None:
    """(H+1, F) largest a.r over states from which the goal can be reached in k = 0..H steps."""
    whole = agent.goal.size == agent.state_dim
    if not whole or np.linalg.cond(agent.A) > WORST_CONDITION:
        return None
    inverse, result = np.linalg.inv(agent.A), np.empty((horizon + 1, len(directions)))
    # x = A^-1 (x' - B u): every step back adds the support of -A^-1 B U and turns the direction.
    rows, total = np.array(directions), np.zeros(len(directions))
    for k in range(horizon + 1):
        result[k] = rows @ agent.goal + total
        rows = rows @ inverse
        total = total + agent.control.support(-rows @ agent.B)
    return result


@lru_cache(maxsize=512)
def reach_of(agent: Agent, normals: tuple[tuple[float, ...], ...], horizon: int) -> Reach:
    """The same, remembered: games ask for it again and again."""
    return Reach(agent, np.array(normals), horizon)
