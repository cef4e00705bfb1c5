"""Plans along ways of all agents past each other, without branch and bound."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, evaluate
from ppg_env.game import objective
from solvers.budget import Budget
from solvers.engine.joint_plans import find_joint_plans
from solvers.engine.presolve import Subproblem
from solvers.pricing import PricedProfile
from tests.marks import first
from tests.solvers.walled_games import KINDS, box, room, walled_game


def joint_plans(game: Game) -> PricedProfile | None:
    agents = tuple(range(len(game.agents)))
    return find_joint_plans(Subproblem(objective.social(game), agents, {}), Budget(None))


def assert_plans(game: Game) -> None:
    plans = joint_plans(game)
    assert plans is not None
    evaluation = evaluate(game, plans.profile)
    assert evaluation.violations() == ()
    assert evaluation.social_cost == pytest.approx(plans.value)


@pytest.mark.parametrize("kind", first(1, ["unequal", "sweeper", "parked"]))
def test_agents_among_walls_get_plans(kind: str) -> None:
    assert_plans(walled_game(kind, 0))


def test_one_agent_gets_a_plan_round_walls_one_behind_the_other() -> None:
    walls = [box(2, 0, 3, 5), box(4.5, 1.2, 5.5, 6.2), *room(0, 0, 8, 6.2)]
    agent = Agent([1, 1], [7, 1], Polytope.box([1.0, 1.0]), Polytope.l1(0.9), noise=0.0)
    game = Game((agent,), tuple(walls), 40, collisions="swept")
    plans = joint_plans(game)
    assert plans is not None
    assert plans.evaluation.feasible
    # Up past the first wall, down past the second one: 4.5 + 4.8 of height, and 6 across.
    assert plans.profile[0].arrival >= np.ceil((4.5 + 4.8 + 6.0) / 0.9 - 1)


def test_no_ways_are_found_when_the_time_is_over() -> None:
    game = walled_game("bend", 0)
    assert find_joint_plans(Subproblem(objective.social(game), (0, 1), {}), Budget(0.0)) is None


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("kind", list(KINDS))
def test_all_kinds_get_plans(kind: str, seed: int) -> None:
    assert_plans(walled_game(kind, seed))


def test_agents_pass_each_other_in_a_tube_in_three_dimensions() -> None:
    sides = [[9, 1, 3], [9, 1, 3], [9, 4, 1], [9, 4, 1]]
    places = [[3, 1.5, 0], [3, -1.5, 0], [3, 0, 1], [3, 0, -1]]
    walls = [
        Polytope.from_vertices(Polytope.box(size).vertices + np.array(place))
        for size, place in zip(sides, places, strict=True)
    ]
    body, control = Polytope.box([0.9, 0.9, 0.9]), Polytope.box([2.0, 2.0, 2.0])
    ends = ([0, 0, 0], [6, 0, 0]), ([6, 0, 0], [0, 0, 0])
    agents = [Agent(a, b, body, control, gain=0.5, noise=0.0) for a, b in ends]
    assert_plans(Game(tuple(agents), tuple(walls), 12, collisions="swept"))
