"""Random small games: no drawn plan is better than a best response."""

from __future__ import annotations

import pytest
from hypothesis import assume, given

from ppg_env import evaluate
from solvers import (
    Status,
    best_response,
    best_response_dynamics,
    potential_equilibrium,
    social_optimum,
)
from tests.marks import first
from tests.oracles.mixed_games import FLAT, mixed_game
from tests.oracles.random_games import drawn_plan, random_game
from tests.oracles.slow_evaluator import slow_evaluation
from tests.ppg_env.strategies import plays
from tests.profiles import examples


@examples(0.4)
@given(plays(scale="exact"))
def test_a_best_response_beats_the_plan_that_was_drawn(play):
    game, profile = play.game, play.profile
    judged = evaluate(game, profile)
    for i in range(len(game.agents)):
        if judged.violations((i,)):
            continue
        cost = judged.shifted_cost[i]
        near = 1e-6 * max(1.0, cost)
        solution = best_response(game, i, profile)
        assert solution.status is Status.OPTIMAL
        assert solution.value <= cost + near
        assert solution.bound <= cost + near
        assert solution.evaluation.violations((i,)) == ()


@examples(0.25)
@given(plays(scale="exact"))
def test_the_social_optimum_beats_the_profile_that_was_drawn(play):
    game, judged = play.game, evaluate(play.game, play.profile)
    assume(judged.feasible)
    solution = social_optimum(game)
    near = 1e-6 * max(1.0, judged.social_cost)
    assert solution.status is Status.OPTIMAL
    assert solution.value <= judged.social_cost + near
    assert solution.bound <= judged.social_cost + near
    found = slow_evaluation(game, [plan.controls for plan in solution.profile])
    assert solution.value == pytest.approx(sum(found.shifted_cost), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", first(2, range(12)))
def test_none_of_many_drawn_plans_beats_a_best_response(seed):
    game, random = random_game(seed)
    profile = tuple(
        next(plan for _ in range(1000) if (plan := drawn_plan(agent, random)))
        for agent in game.agents
    )
    solution = best_response(game, 0, profile)
    assert solution.status is Status.OPTIMAL
    sound = 0
    for _ in range(400):
        plan = drawn_plan(game.agents[0], random)
        if plan is None:
            continue
        judged = evaluate(game, (plan, *profile[1:]))
        if not judged.violations((0,)):
            sound += 1
            assert solution.value <= judged.shifted_cost[0] + 1e-6
            assert solution.bound <= judged.shifted_cost[0] + 1e-6
    assert sound > 5


@pytest.mark.parametrize("seed", first(3, FLAT[:50]))
def test_a_best_response_in_motion_beats_the_plan_that_was_drawn(seed):
    mixed = mixed_game(seed, in_motion=True)
    game, judged = mixed.game, evaluate(mixed.game, mixed.profile)
    for i in range(2):
        response = best_response(game, i, mixed.profile)
        if not judged.violations((i,)):
            assert response.bound <= judged.shifted_cost[i] + 1e-6
            assert response.value <= judged.shifted_cost[i] + 1e-6
        if response.profile is not None:
            found = slow_evaluation(game, [plan.controls for plan in response.profile])
            assert response.value == pytest.approx(found.shifted_cost[i], rel=1e-6, abs=1e-6)
            assert max(found.control[i], found.within[i]) <= 1e-6
            met = [e for e, one in enumerate(game.encounters) if i in one.agents]
            assert max([found.overlap[e] for e in met], default=0.0) <= 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_equilibria_and_optima_of_random_games_keep_their_promises(seed):
    game, _ = random_game(seed)
    social, potential = social_optimum(game), potential_equilibrium(game)
    nash = best_response_dynamics(game, start="sequential", seed=seed, order="random")
    assert social.status is Status.OPTIMAL
    assert potential.status is Status.OPTIMAL
    assert potential.regret.max() <= 1e-5
    assert nash.status in (Status.EQUILIBRIUM, Status.INFEASIBLE)
    for solution in (potential, nash):
        if solution.profile is not None:
            assert solution.regret.max() <= 1e-5
            assert solution.evaluation.potential >= potential.bound - 1e-6
            assert solution.evaluation.social_cost >= social.bound - 1e-6
