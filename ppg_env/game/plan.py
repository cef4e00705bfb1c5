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
from ppg_env.game.dynamics import goal_selector, rollout
from ppg_env.game.game import Agent, Game
from ppg_env.game.input_sets import excess, room
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


def straight_plan(agent: Agent, horizon: int) -> Plan | None:
    """The plan that heads for the goal as if alone: least effort, in the fewest steps it admits.

    With A = B = I that is the straight line at constant speed.  Least effort is the
    minimum-norm solution of the reachability equation; a time is admitted when those controls
    lie in their sets, or those of least sum of u_t' u_t / room_t, which bear what the first leave
    room for: where speed sets change, the straight line is flown as fast as they let.  None when
    no time up to ``horizon`` is admitted.
    """
    select, power, blocks = goal_selector(agent), np.eye(agent.state_dim), []
    controls = np.zeros((horizon, agent.control_dim))
    if make_plan(agent, controls).arrival == 0:
        return make_plan(agent, controls)
    for t in range(1, horizon + 1):
        blocks.append(power @ agent.B)
        power = power @ agent.A
        effect = select @ np.hstack(blocks[::-1])
        wanted = agent.goal - select @ power @ agent.start
        steps = _least_effort(effect, wanted, np.ones(t))
        left = room(agent.control, steps)
        if left.min() < 1 < left.max():  # some bear too much, and others could bear more
            steps = _least_effort(effect, wanted, np.sqrt(left))
        reached = np.abs(effect @ steps.ravel() - wanted).max() <= tol.LENGTH
        if reached and excess(agent.control, steps) <= tol.CONTROL:
            controls[:t] = steps
            return make_plan(agent, controls)
    return None


def _least_effort(effect: np.ndarray, wanted: np.ndarray, bearing: np.ndarray) -> np.ndarray:
    """(t, m) controls with ``effect`` u = ``wanted`` and the least sum of |u_k / bearing_k|^2."""
    share = np.repeat(bearing, effect.shape[1] // len(bearing))
    effort = share * np.linalg.lstsq(effect * share, wanted, rcond=None)[0]
    return effort.reshape(len(bearing), -1)
