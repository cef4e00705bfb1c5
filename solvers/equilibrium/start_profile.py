"""First profiles of best-response dynamics: straight, sequential or given."""

from __future__ import annotations

import numpy as np

from ppg_env.errors import require
from ppg_env.game.agent import Agent
from ppg_env.game.least_effort import straight_plan
from ppg_env.game.plan import Plan, Profile, make_profile
from ppg_env.support.frozen import frozen_array
from solvers.liability import Liability

STARTS = ("straight", "sequential")

MOST_STRAIGHT = 5
"""With more agents than this the first profile is sequential."""


def default_starts(rule: Liability) -> tuple[str, ...]:
    """Return the starts to try in turn, until one lets all agents find a plan.

    Straight lines of many agents all cross at once.  With right of way, an agent must not be
    held up by one that yields to it.
    """
    crowd = len(rule.game.agents) > MOST_STRAIGHT or rule.priority is not None
    return ("sequential",) if crowd else STARTS


def start_profile(rule: Liability, start: str | Profile) -> tuple[Profile, set[int]]:
    """Return the first profile and the agents in it that have no plan yet.

    Raises
    ------
    InputError
        If ``start`` is neither one of :data:`STARTS` nor a full profile.
    """
    game = rule.game
    if not isinstance(start, str):
        require(
            len(start) == len(game.agents),
            "start",
            "does not have one plan per agent",
            "give a full profile",
        )
        return make_profile(game, [plan.controls for plan in start]), set()
    require(start in STARTS, "start", f"is {start!r}", "write " + " or ".join(STARTS))
    plans: list[Plan] = []
    pending = set()
    for i, agent in enumerate(game.agents):
        plan = straight_plan(agent, game.horizon) if start == "straight" else None
        if plan is None:
            pending.add(i)
            plan = absent_plan(agent, game.horizon)
        plans.append(plan)
    return tuple(plans), pending


def absent_plan(agent: Agent, horizon: int) -> Plan:
    """Return a stand-in plan that is never in traffic, for an agent without a plan."""
    means = np.tile(agent.start, (horizon + 1, 1))
    return Plan(frozen_array(np.zeros((horizon, agent.control_dim))), frozen_array(means), 0)
