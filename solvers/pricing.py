"""Price the plans that controls make: plans, evaluation, feasibility and value in one step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ppg_env.game.evaluation import Evaluation, evaluate
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Plan, Profile, make_plan


@dataclass(frozen=True)
class PricedProfile:
    """A feasible profile, its evaluation, and the value of an objective at it."""

    profile: Profile
    evaluation: Evaluation
    value: float


def price(
    objective: Objective, controls: Mapping[int, np.ndarray], given: Mapping[int, Plan]
) -> PricedProfile | None:
    """Return the plans that ``controls`` make, with their evaluation and value.

    Parameters
    ----------
    controls
        (H, m) controls of each agent that moves.
    given
        Plans of the other agents.  Their means are taken as they are, because they may be
        predictions.

    Returns
    -------
    PricedProfile or None
        None if a constraint that involves a moving agent is violated.
    """
    agents = objective.game.agents
    profile = tuple(
        make_plan(agent, controls[i]) if i in controls else given[i]
        for i, agent in enumerate(agents)
    )
    if any(profile[i].arrival is None for i in controls):
        return None
    evaluation = evaluate(objective.game, profile, as_given=True)
    if not evaluation.is_feasible(controls):
        return None
    return PricedProfile(profile, evaluation, evaluation.weighted(objective))


def price_profile(objective: Objective, profile: Profile) -> PricedProfile | None:
    """Return :func:`price` of the controls of all agents."""
    return price(objective, {i: plan.controls for i, plan in enumerate(profile)}, {})
