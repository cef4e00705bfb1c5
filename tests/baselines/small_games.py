"""Games of unequal agents, and of one and three axes."""

from __future__ import annotations

import numpy as np

from ppg_env import Agent, Game, Polytope

BODY = Polytope.box([4.0, 4.0])
FULL = Polytope.box([10.0, 10.0])


def sizes() -> Game:
    """One input, and two."""
    rail = {"B": [[1.0], [0.0]], "noise": [[1.0, 0.0], [0.0, 0.0]], "gain": [[0.5, 0.0]]}
    train = Agent([0, 0], [30, 0], BODY, Polytope.box([8.0]), **rail)
    return Game((train, Agent([30, 9], [0, 9], BODY, FULL, gain=0.5)), horizon=10)


def line() -> Game:
    """One axis."""
    body, control = Polytope.box([2.0]), Polytope.box([6.0])
    agents = (
        Agent([0.0], [20.0], body, control, gain=0.5),
        Agent([30.0], [45.0], body, control, gain=0.5),
    )
    return Game(agents, horizon=10)


def space() -> Game:
    """Three axes, an obstacle, and no inputs upwards for the first agent."""
    body, wall = Polytope.box([3.0] * 3), Polytope.box([4.0] * 3)
    agents = (
        Agent([0, 0, 0], [30, 0, 0], body, Polytope.box([9.0, 9.0, 0.0]), gain=0.3),
        Agent([30, 9, 5], [0, 9, 5], body, Polytope.l1(9.0, 3), gain=0.5),
    )
    obstacle = Polytope.from_vertices(wall.vertices + np.array([15.0, 4.0, 0.0]))
    return Game(agents, (obstacle,), horizon=10)
