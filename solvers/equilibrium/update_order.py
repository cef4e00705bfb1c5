"""Orders in which the agents update their plans."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ppg_env.errors import InputError
from ppg_env.game.game import Game
from solvers.liability import Liability

ORDERS = ("cyclic", "random", "simultaneous")


def check_order(game: Game, order: str | Sequence[int]) -> None:
    """Raise InputError unless ``order`` is one of :data:`ORDERS` or a permutation of the agents."""
    if isinstance(order, str):
        valid = order in ORDERS
    else:
        valid = sorted(order) == list(range(len(game.agents)))
    if not valid:
        raise InputError(
            "order",
            f"is {order!r}",
            "write " + ", ".join(ORDERS) + " or a permutation of the agents",
        )


def sweep_groups(
    rule: Liability, order: str | Sequence[int], random: np.random.Generator
) -> list[tuple[int, ...]]:
    """Return the groups of agents that update together in one sweep, in turn.

    A group is a single agent, or all agents if updates are simultaneous.
    """
    agents = rule.priority or range(len(rule.game.agents))
    if order == "simultaneous":
        return [tuple(agents)]
    if order == "cyclic":
        return [(i,) for i in agents]
    if order == "random":
        return [(int(i),) for i in random.permutation(len(agents))]
    return [(int(i),) for i in order]
