"""Games of two agents on a line, small enough for independent computations."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ndtr

from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.polytope import Polytope

NOISE, BODY, LAM, KAPPA = 1.9, 15.0, 0.8, 100.0


def interval(low: float, high: float) -> Polytope:
    return Polytope.from_vertices([[low], [high]])


def line_agent(
    start: float, goal: float, low: float = -10.0, high: float = 10.0, **more: Any
) -> Agent:
    return Agent(
        start=[start], goal=[goal], shape=Polytope.box([BODY]), control=interval(low, high),
        lam=LAM, noise=NOISE, gain=0.5, **more,
    )  # fmt: skip


def line_game(*agents: Agent, horizon: int = 10, **more: Any) -> Game:
    return Game(agents, objective="risk", crash_cost=KAPPA, horizon=horizon, **more)


def overlap(gap: np.ndarray | float, variance: float = 2 * NOISE) -> np.ndarray:
    """Probability that two bodies overlap whose distance is ``gap`` on average."""
    s = np.sqrt(variance)
    return ndtr((BODY - gap) / s) - ndtr((-BODY - gap) / s)


def alone(start: float, goal: float, steps: int, tolerance: float = 5.0) -> float:
    """Expected cost of an agent alone, by the transition matrix of a fine chain."""
    x = np.arange(min(start, goal) - 30, max(start, goal) + 30, 0.1)
    spread = np.sqrt(NOISE)
    edges = np.concatenate([x - 0.05, [x[-1] + 0.05]])
    matrix = np.diff(ndtr((edges[None] - x[:, None]) / spread), axis=1)
    matrix[:, np.abs(x - goal) <= tolerance] = 0.0
    value = np.zeros(len(x))
    for _ in range(steps):
        after = matrix @ value
        moves = [np.interp(x + u, x, after) for u in np.linspace(-10, 10, 81)]
        value = LAM + np.min(moves, axis=0)
    return float(np.interp(start, x, value))
