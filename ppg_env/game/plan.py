"""Plans and profiles: the nominal controls of one agent, and those of all agents.

Controls determine means and arrival.  An agent leaves the game at its arrival: from then on its
mean is constant and its controls are zero.
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
from ppg_env.support.validation import finite_array, shape_text


@dataclass(frozen=True, eq=False)
class Plan(Record):
    """One agent's plan; build it with :func:`make_plan`.

    Attributes
    ----------
    controls : (H, m) nominal inputs, zero from the arrival.
    means : (H+1, n) nominal states, constant from the arrival.
    arrival : first time at which the mean is at the goal; None if it never is.
    """

    controls: np.ndarray
    means: np.ndarray
    arrival: int | None


Profile = tuple[Plan, ...]
"""One plan per agent, in the order of ``game.agents``."""


def make_plan(agent: Agent, controls: Any) -> Plan:
    """Return the plan of ``controls`` (H, m) applied from the agent's start until it arrives."""
    controls = np.array(finite_array(controls, "controls", "write rows of finite numbers"))
    means = rollout(agent, controls)
    units = agent.state_units[: agent.goal.size]
    miss = (np.abs(means @ goal_selector(agent).T - agent.goal) / units).max(axis=1)
    at_goal = np.flatnonzero(miss <= tol.LENGTH)
    arrival = int(at_goal[0]) if at_goal.size else None
    if arrival is not None:
        controls[arrival:] = 0.0
        means[arrival:] = means[arrival]
    return Plan(frozen_array(controls), frozen_array(means), arrival)


def make_profile(game: Game, controls: Sequence[Any]) -> Profile:
    """Return the profile of each agent's controls, shapes checked.

    Raises
    ------
    InputError
        If there are not N sequences of (H, m) finite numbers, at most ``tol.LARGEST`` in size.
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
        array = finite_array(sequence, f"controls[{i}]", remedy)
        require(
            array.shape == (game.horizon, agent.control_dim),
            f"controls[{i}]",
            f"has shape {shape_text(array)}",
            remedy,
        )
        plans.append(make_plan(agent, array))
    return tuple(plans)
