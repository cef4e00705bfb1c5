"""Lower bounds on arrivals among bodies that rest, and proofs that goals are out of reach."""

from __future__ import annotations

from functools import lru_cache

from ppg_env.game.barriers import barriers
from ppg_env.game.free_space import MOST_CELLS, FreeSpace
from ppg_env.game.game import Game
from ppg_env.game.reachability import earliest_arrival


@lru_cache(maxsize=1024)
def earliest_way(game: Game, index: int) -> int | None:
    """Return a lower bound on the arrival of an agent among the bodies that rest at all times.

    Where there are none, it is the earliest arrival without other bodies.  The result is None if
    the agent cannot reach its goal within the horizon.
    """
    first = earliest_arrival(game.agents[index], game.horizon)
    if not first or not has_walls(game, index):
        return first
    bodies = [body for body in barriers(game, index, {}) if body.rests]
    later = next(FreeSpace(game, index, bodies).arrivals(), None)
    return None if later is None else max(first, later)


def has_walls(game: Game, index: int) -> bool:
    """Return whether bodies that rest at all times confine an agent, and cells can show it."""
    at_rest = any(body.rests for body in barriers(game, index, {}))
    return at_rest and game.dim in MOST_CELLS
