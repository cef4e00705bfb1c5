r"""Arrival regions: how close to its goal an agent has to come.

    |x_k - goal_k| <= tolerance_k        for every component k of the goal

By default the tolerance is half of the agent's longest step, per component:

    tolerance_k = max_u |(B u)_k| / 2 + max_x |((A - I) x)_k| / 2

over the inputs u of all its control sets, and bounds on the states x of plans that reach the goal
as early as possible, within the workspace.  The second term is zero for A = I.  For a double
integrator it is the speed at which that plan passes the middle of its way, from rest to rest about
sqrt(length * acceleration), or the speed limit of the workspace if that is lower.

A component that no step changes has the widest tolerance of the others, in the units of the state
(:mod:`ppg_env.game.units`).  The region thus scales with the game, and half a step suffices not to
fly past it.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.rules import Rules
from ppg_env.errors import InputError
from ppg_env.game.agent import Agent
from ppg_env.game.canonical import canonical_agent
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from ppg_env.game.reachability import plan_upper, sufficient_horizon
from ppg_env.game.step_lengths import workspace_support


def arrival_tolerances(game: Game, tolerance: float | None = None) -> list[np.ndarray]:
    """Return the half widths of each agent's arrival region, one per component of its goal.

    A ``tolerance`` holds for all agents and components; None stands for half of the longest step.
    """
    if tolerance is not None:
        return [np.full(agent.goal.size, float(tolerance)) for agent in game.agents]
    return [_half_steps(agent, game.horizon) for agent in game.agents]


def checked_tolerances(game: Game, rules: Rules) -> list[np.ndarray]:
    """Return :func:`arrival_tolerances` of ``rules``, checked against the starts.

    Raises
    ------
    InputError
        If an agent starts inside its arrival region, but not at its goal: it would have arrived
        before its first step.
    """
    tolerances = arrival_tolerances(game, rules.tolerance)
    if rules.arrival == "region":
        check_starts(game.agents, tolerances)
    return tolerances


def check_starts(agents: Sequence[Agent], tolerances: Sequence[np.ndarray]) -> None:
    """Refuse agents that start inside their arrival regions, but not at their goals.

    Raises
    ------
    InputError
        If there is one.
    """
    for i, (agent, half) in enumerate(zip(agents, tolerances, strict=True)):
        away = np.abs(agent.start[: agent.goal.size] - agent.goal)
        if away.any() and (away <= half).all():
            width = " x ".join(f"{k:.4g}" for k in np.unique(half)[::-1])
            raise InputError(
                f"agent[{i}].start",
                f"is inside the agent's arrival region, the goal plus or minus {width}",
                f"pass a tolerance below {away.max():.4g}, start at the goal, or let agents arrive "
                "on schedule",
            )


def _half_steps(agent: Agent, horizon: int) -> np.ndarray:
    size = agent.goal.size
    longest = np.zeros(size)
    for _, admissible in pieces(agent.control):
        pushes = np.abs(admissible.vertices @ agent.B[:size].T)
        longest = np.maximum(longest, pushes.max(axis=0))
    longest += _drifts(agent, horizon)
    units = agent.state_units[:size]
    widest = float((longest / units).max())
    idle = longest <= tol.FLAT * widest * units
    return np.asarray(np.where(idle, widest * units, longest) / 2)


def _drifts(agent: Agent, horizon: int) -> np.ndarray:
    """Return the largest change of each goal component that the state alone causes in a step."""
    units, size = agent.state_units[: agent.goal.size], agent.goal.size
    agent, _ = canonical_agent(agent)
    rows = (agent.A - np.eye(agent.state_dim))[:size]
    drifts, moved = np.zeros(size), np.flatnonzero(rows.any(axis=1))
    if not moved.size:
        return drifts
    if agent.reserve:  # what planners leave to feedback is an input of the agent all the same
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a spectral radius: the agent has had its warning
            agent = replace(agent, reserve=0.0)
    both = np.vstack([rows[moved], -rows[moved]])
    arrival = sufficient_horizon(agent, horizon)
    most = plan_upper(agent, both, horizon if arrival is None else arrival).max(axis=0)
    most = np.minimum(most, [workspace_support(agent, row, horizon) for row in both])
    drifts[moved] = np.maximum(most.reshape(2, -1).max(axis=0), 0.0)
    return drifts * units
