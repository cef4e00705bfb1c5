"""Ways past each other after few agents left and found new ones."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, evaluate
from ppg_env.game import objective
from solvers.budget import Budget
from solvers.engine.joint_plans import find_joint_plans
from solvers.engine.presolve import Subproblem
from tests.solvers.walled_games import box, room, walled_game


def planned(game: Game):
    agents = tuple(range(len(game.agents)))
    return find_joint_plans(Subproblem(objective.social(game), agents, {}), Budget(None))


def passing(noise: float) -> Game:
    """Two bodies that pass each other in a hall wide enough for both, at a post in the middle."""
    walls = [box(3.5, 2.8, 4.5, 3.2), *room(0, 0, 8, 6)]
    shape, speed = Polytope.box([0.8, 0.8]), Polytope.box([2.0, 2.0])
    ends = ([1.0, 3.0], [7.0, 3.0])
    agents = [Agent(a, b, shape, speed, noise=noise, gain=0.5) for a, b in (ends, ends[::-1])]
    return Game(tuple(agents), tuple(walls), 24, objective="risk", collisions="swept")


def test_where_ways_are_wide_no_agent_waits():
    plans = planned(passing(0.0))
    assert [plan.arrival for plan in plans.profile] == [6, 6]


def test_ways_keep_margins_where_there_is_room():
    game = passing(0.003)
    plans = planned(game)
    evaluation = evaluate(game, plans.profile)
    assert evaluation.violations() == ()
    time = sum(
        agent.lam * plan.arrival for agent, plan in zip(game.agents, plans.profile, strict=True)
    )
    assert evaluation.social_cost - time < 0.1
    assert sum(plan.arrival for plan in plans.profile) <= 14


@pytest.mark.slow
def test_four_agents_among_pillars_lose_little_time():
    plans = planned(walled_game("pillars", 2))  # alone they take 9 steps each
    assert plans.evaluation.social_cost < 36
    assert np.max([plan.arrival for plan in plans.profile]) <= 13
