"""Plans and profiles: what an agent means to do, and what everybody means to do.

A plan is its controls; means and arrival follow from them.  From its arrival on the agent has
left the game: its mean stays where it arrived and its controls are zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import require
from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import goal_selector, rollout
from ppg_env.game.game import Game
from ppg_env.support.frozen import Record, frozen_array
from ppg_env.support.validation import numbers


@dataclass(frozen=True, eq=False)
class Plan(Record):
    """One agent's plan; made by :func:`make_plan`.

    Attributes
    ----------
    controls : (H, m) nominal inputs, zero from the arrival on.
    means : (H+1, n) nominal states, constant from the arrival on.
    arrival : first time at which the mean is at the goal; None if that never happens.
    """

    controls: np.ndarray
    means: np.ndarray
    arrival: int | None


Profile = tuple[Plan, ...]
"""One plan per agent, in the order of ``game.agents``."""


def make_plan(agent: Agent, controls: Any) -> Plan:
    """The plan that plays ``controls`` (H, m) from the agent's start until it arrives."""
    controls = np.array(controls, dtype=np.float64)
    means = rollout(agent, controls)
    miss = np.abs(means @ goal_selector(agent).T - agent.goal).max(axis=1)
    there = np.flatnonzero(miss <= tol.LENGTH)
    arrival = int(there[0]) if there.size else None
    if arrival is not None:
        controls[arrival:] = 0.0
        means[arrival:] = means[arrival]
    return Plan(frozen_array(controls), frozen_array(means), arrival)


def make_profile(game: Game, controls: Sequence[Any]) -> Profile:
    """A profile from each agent's controls, shapes checked.

    Raises
    ------
    InputError
        If there are not N sequences of (H, m) finite numbers.
    """
    require(
        len(controls) == len(game.agents),
        "controls",
        f"has {len(controls)} plans for {len(game.agents)} agents",
        "give one list of controls per agent",
    )
    plans = []
    for i, (agent, sequence) in enumerate(zip(game.agents, controls, strict=True)):
        remedy = f"write {game.horizon} rows of {agent.control_dim} numbers"
        try:
            array = numbers(sequence)
        except ValueError:
            array = np.array(np.nan)
        require(
            array.shape == (game.horizon, agent.control_dim) and bool(np.isfinite(array).all()),
            f"controls[{i}]",
            "is not a full table of finite numbers",
            remedy,
        )
        plans.append(make_plan(agent, array))
    return tuple(plans)
