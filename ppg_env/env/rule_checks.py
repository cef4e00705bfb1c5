"""Whether a rule of random draws fits a game: every value that it may draw is one of its agent."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ppg_env.env.arrays import Tables
from ppg_env.env.draws import own_number
from ppg_env.env.randomize import FIELDS, SCALARS, Distribution, Randomize
from ppg_env.env.reset_options import checked_size, whole_point
from ppg_env.errors import InputError, placed, require
from ppg_env.game.checks import check_scales
from ppg_env.game.game import Game


def check_rule(rule: Randomize, game: Game, tables: Tables) -> None:
    """Refuse a rule that may draw what is not a value of an agent of ``game``.

    Raises
    ------
    InputError
        If it may, or draws what the reward cannot count.
    """
    drawn = [field for field in FIELDS if getattr(rule, field) is not None]
    refuse_with_margins(drawn, tables, "randomize")
    most = max(rule.counts(len(game.agents)))
    require(
        most <= len(game.agents),
        "randomize.agents",
        f"may be {most}, and the game has {len(game.agents)}",
        "name numbers up to that of the game's agents",
    )
    for field in drawn:
        for i, distribution in enumerate(rule.each(field, game.agent_names)):
            if distribution is not None:
                with placed("randomize"), placed(f"agent[{i}]"):
                    _check(distribution, field, game, i)


def refuse_with_margins(fields: Sequence[str], tables: Tables, place: str) -> None:
    """Refuse ``fields`` that would change the units of margins, if the reward counts margins.

    Raises
    ------
    InputError
        If there are any.
    """
    for field in fields:
        if tables.margin_reward and field in ("noise", "size"):
            raise InputError(
                f"{place}.{field}",
                "cannot change from episode to episode with reward = 'margin', which counts "
                "margins of planned noise and bodies",
                "choose reward = 'risk', or change the game",
            )


def _check(distribution: Distribution, field: str, game: Game, i: int) -> None:
    agent, k = game.agents[i], distribution.components
    if field in SCALARS:
        require(k == 0, field, f"draws points of {k} numbers", "draw numbers")
        own = own_number(field, game, i)
    else:
        sizes = sorted({agent.dim, getattr(agent, field).size})
        remedy = "draw points of " + " or ".join(map(str, sizes))
        require(k in (0, *sizes), field, f"draws points of {k} numbers", remedy)
        own = getattr(agent, field)[: k or agent.dim]
    for value in distribution.extremes(own):
        if field == "size":
            checked_size(float(value[0]), field)
            require(
                bool((agent.shape.offsets >= 0).all()),
                field,
                "is drawn for a body that is not around its reference point",
                "give the body vertices around zero",
            )
            continue
        changes: dict[str, Any] = {field: float(value[0]) if field in SCALARS else value}
        if field not in SCALARS:
            changes[field] = whole_point(value, getattr(agent, field), agent.dim, field)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of growing errors: the agent has been reported
            check_scales(replace(agent, **changes))
