"""Lower bounds on arrivals among obstacles, and proofs that goals are out of reach.

Bodies that rest close ways (:mod:`ppg_env.game.free_space`) and make them long
(:mod:`ppg_env.game.geodesic`), bodies that move pass over goals (:mod:`ppg_env.game.goal_hits`).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ppg_env.game.barriers import barriers, starts_at_goal
from ppg_env.game.free_space import MOST_CELLS, FreeSpace
from ppg_env.game.game import Game
from ppg_env.game.geodesic import least_steps
from ppg_env.game.goal_hits import hit_arrivals
from ppg_env.game.reachability import earliest_arrival
from ppg_env.game.step_grid import least_hops


@lru_cache(maxsize=1024)
def earliest_way(game: Game, index: int) -> int | None:
    """Return a lower bound on the arrival of an agent among obstacles, and bodies that rest.

    Where there are none, it is the earliest arrival without other bodies.  The result is None if
    the agent cannot reach its goal within the horizon, or is hit there whatever it does.
    """
    first = earliest_arrival(game.agents[index], game.horizon)
    hit = np.asarray(hit_arrivals(game, index).any(axis=0))
    if starts_at_goal(game.agents[index]):
        return None if hit[0] else first
    if first and has_walls(game, index):
        bodies = [body for body in barriers(game, index, {}) if body.rests]
        later = next(FreeSpace(game, index, bodies).arrivals(), None)
        first = None if later is None else max(first, later)
        if first is not None and game.collisions == "swept" and game.dim == 2:
            around = least_steps(game.agents[index], bodies, game.horizon)
            first = None if around is None else max(first, around)
    if first is None or hit[first:].all():
        return None
    return first + int(np.argmin(hit[first:]))


@lru_cache(maxsize=256)
def fewest_steps(game: Game, index: int) -> int | None:
    """Return :func:`earliest_way`, or a larger bound that sees each step of a way around corners.

    It takes about two seconds among many bodies.
    """
    first = earliest_way(game, index)
    if not first or game.collisions != "swept" or game.dim != 2 or not has_walls(game, index):
        return first
    bodies = [body for body in barriers(game, index, {}) if body.rests]
    space = FreeSpace(game, index, bodies)
    if space.cells is None:
        return None
    kernel = space.longest_kernel(space.cells)
    hops = least_hops(space.cells, space.bodies, kernel, space.start, space.goal)
    return None if hops is None or hops > game.horizon else max(first, hops)


def sealed(game: Game, index: int) -> bool:
    """Return whether bodies at rest keep an agent from its goal, however long the horizon.

    False proves nothing.  Where bodies keep apart at instants alone, no wall closes a way.
    """
    if game.collisions != "swept" or not has_walls(game, index):
        return False
    bodies = [body for body in barriers(game, index, {}) if body.rests]
    return FreeSpace(game, index, bodies).sealed()


def has_walls(game: Game, index: int) -> bool:
    """Return whether bodies that rest at all times confine an agent, and cells can show it."""
    at_rest = any(body.rests for body in barriers(game, index, {}))
    return at_rest and game.dim in MOST_CELLS
