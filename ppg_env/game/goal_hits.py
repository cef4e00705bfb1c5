"""Arrivals at which an obstacle hits an agent at its goal, whatever its plan."""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.margins import over_events

DEPTH = 3 * tol.LENGTH
"""Least depth of a hit: bodies may overlap by LENGTH, and means miss goals by it along each axis.
"""


def hit_arrivals(game: Game, index: int) -> np.ndarray:
    """Return (K, H+1) whether each obstacle hits an agent that arrives at its goal at each time.

    A body that stays is hit at every later time at which the obstacle passes over its goal.  Where
    bodies keep apart during steps, it is also hit if the obstacle is over the goal at the arrival.
    """
    result = np.zeros((len(game.obstacles), game.horizon + 1), dtype=bool)
    for encounter in game.encounters:
        k = encounter.obstacle
        if k is not None and index in encounter.agents and game.obstacles[k].path is not None:
            result[k] = _hit_arrivals(game, encounter)
    return result


def _hit_arrivals(game: Game, encounter: Encounter) -> np.ndarray:
    """Return (H+1,) whether the obstacle of an encounter hits its agent, for each arrival."""
    (i,), collision = encounter.agents, encounter.collision
    assert encounter.obstacle is not None
    obstacle, steps = game.obstacles[encounter.obstacle], game.horizon + 1
    until = steps if obstacle.until is None else obstacle.until
    apart = game.agents[i].goal[: game.dim] - obstacle.positions(game.horizon)
    clear = apart @ collision.normals.T - collision.offsets
    deep = -DEPTH * game.unit
    result = np.zeros(steps, dtype=bool)
    if game.on_goal == "stay":
        during = over_events(game, clear).max(axis=1) < deep
        during[min(until, obstacle.rest) :] = False
        result[: len(during)] = np.logical_or.accumulate(during[::-1])[::-1]
    if game.collisions == "swept":
        result[1 : until + 1] |= clear[1 : until + 1].max(axis=1) < deep
    return result
