"""Profiles whose crash probabilities are known in closed form."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from ppg_env import Agent, Game, Polytope
from ppg_env.game.plan import Profile
from tests.oracles.plain_monte_carlo import fly


def wall(distance: float, angle: float = 0.0) -> tuple[Game, Profile]:
    """One agent flies along a long wall, whose face its body is ``distance`` from at time 1."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = np.array([[-500, 1], [500, 1], [500, 500], [-500, 500]], float)
    corners[:, 1] += distance
    body = Polytope.from_vertices(np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ turn.T)
    noise = turn @ np.array([[0.8, 0.3], [0.3, 2.0]]) @ turn.T
    agent = Agent([0, 0], turn @ [4, 0], body, Polytope.disc(2.2), noise=noise)
    return (game := Game((agent,), (Polytope.from_vertices(corners @ turn.T),), horizon=2)), fly(
        game
    )


def boxes(distance: float, across: float) -> tuple[Game, Profile, float]:
    """Two boxes at a single instant, axes independent, and their exact crash probability."""
    agents = [
        Agent(
            [x, y],
            [x, y + 4],
            Polytope.box(sides),
            Polytope.box([4, 4]),
            noise=[[1.2, 0], [0, 0.7]],
        )
        for x, y, sides in ((0.0, 0.0, [2.0, 1.0]), (distance, across, [2.0, 3.0]))
    ]
    exact = 1.0
    for mean, variance in ((-distance, 2.4), (-across, 1.4)):
        high, low = (norm.logcdf((half - mean) / np.sqrt(variance)) for half in (2.0, -2.0))
        if mean < 0:  # the tail that keeps its digits
            high, low = (norm.logsf((half - mean) / np.sqrt(variance)) for half in (-2.0, 2.0))
        exact *= np.exp(high) - np.exp(low)
    game = Game(tuple(agents), horizon=3)
    return game, fly(game), exact
