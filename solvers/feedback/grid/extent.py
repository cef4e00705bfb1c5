"""The games that dynamic programming on a grid can represent."""

from __future__ import annotations

from ppg_env.env.rules import Rules
from ppg_env.errors import InputError
from ppg_env.game.game import Game


def dynamic_programming_applies(game: Game, rules: Rules | None = None) -> bool:
    """Return whether the game and its rules have a grid model of the joint state."""
    from solvers.feedback.grid.joint_model import check_extent

    try:
        check_extent(game, (Rules() if rules is None else rules).of(game))
    except InputError:
        return False
    return True
