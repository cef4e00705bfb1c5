"""Planners against the evaluators, over the paper's scenarios: one objective, one set of means."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import evaluate, make_game, make_profile, straight_plan
from solvers import best_response, best_response_dynamics, potential_equilibrium, social_optimum
from solvers.solution import Status
from tests.oracles.slow_evaluator import slow_evaluation

SAME = 1e-6
GAP = 1e-5
"""Tangents are refined to 1e-7 of the cost, which is 1e-5 at the largest costs here."""


def replayed(agent, controls):
    """Means of the noise-free dynamics, step by step."""
    x, states = np.array(agent.start), [np.array(agent.start)]
    for u in controls:
        x = agent.A @ x + agent.B @ u
        states.append(x)
    return np.array(states)


def test_the_social_optimum_is_proved_and_worth_what_the_evaluator_says(paper_game, social):
    assert social.status is Status.OPTIMAL
    judged = evaluate(paper_game, social.profile)
    assert judged.violations() == ()
    assert social.value == pytest.approx(judged.social_cost, abs=SAME)
    assert -SAME <= social.value - social.bound <= GAP


def test_the_potential_program_is_proved_and_worth_what_the_evaluator_says(paper_game, potential):
    assert potential.status is Status.OPTIMAL
    judged = evaluate(paper_game, potential.profile)
    assert judged.violations() == ()
    assert potential.value == pytest.approx(judged.potential, abs=SAME)
    assert -SAME <= potential.value - potential.bound <= GAP


def test_a_second_evaluator_in_plain_loops_agrees_on_every_cost(paper_game, social, potential):
    for solution in (social, potential):
        found = slow_evaluation(paper_game, [plan.controls for plan in solution.profile])
        assert found.arrival == list(solution.evaluation.arrival)
        np.testing.assert_allclose(solution.evaluation.shifted_cost, found.shifted_cost, atol=SAME)
        np.testing.assert_allclose(solution.evaluation.cost, found.cost, atol=SAME)
    assert social.value == pytest.approx(
        sum(slow_evaluation(paper_game, [plan.controls for plan in social.profile]).shifted_cost),
        abs=SAME,
    )


def test_a_replay_without_noise_follows_the_means_to_the_goal(paper_game, social):
    for agent, plan in zip(paper_game.agents, social.profile, strict=True):
        until = plan.arrival + 1
        states = replayed(agent, plan.controls[: plan.arrival])
        np.testing.assert_allclose(plan.means[:until], states, atol=SAME)
        np.testing.assert_allclose(states[-1], agent.goal, atol=SAME)
        assert agent.control.clearance(plan.controls).max() <= SAME


def test_an_optimum_cannot_be_beaten_by_an_equilibrium(paper_game, social, potential, nash):
    for equilibrium in (potential, nash):
        assert equilibrium.evaluation.social_cost >= social.bound - SAME
        assert equilibrium.evaluation.potential >= potential.bound - SAME


def test_a_best_response_costs_no_more_than_the_plan_in_hand(paper_game, social):
    for i in range(len(paper_game.agents)):
        response = best_response(paper_game, i, social.profile)
        assert response.value <= social.evaluation.shifted_cost[i] + SAME
        assert response.bound <= social.evaluation.shifted_cost[i] + SAME


@pytest.mark.parametrize(
    ("name", "speed", "objective"),
    [
        ("parallel", "box", "risk"),
        ("intersection", "box", "margin"),
        ("intersection", "l1", "margin"),
        ("opposing", "l1", "risk"),
    ],
)
def test_solving_twice_gives_the_same_controls(name, speed, objective):
    game = make_game(name, speed=speed, objective=objective)
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    planners = [
        lambda: best_response(game, 0, straight),
        lambda: social_optimum(game),
        lambda: best_response_dynamics(game, order="random", seed=3),
    ]
    for plan in planners:
        first, again = plan(), plan()
        assert first.value == again.value
        assert first.profile == again.profile


def test_an_answer_does_not_depend_on_what_was_solved_before():
    game = make_game("head_on", speed="l1")
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    first = best_response(game, 0, straight)
    best_response(game, 0, social_optimum(game).profile)
    assert best_response(game, 0, straight).profile == first.profile


@pytest.mark.parametrize("lam", [0.0, 0.5])
def test_a_game_that_is_over_before_it_begins_costs_nothing(lam):
    starts = {i: agent.start for i, agent in enumerate(make_game("parallel").agents)}
    game = make_game("parallel", lam=lam, goal=starts)
    for solution in (social_optimum(game), potential_equilibrium(game)):
        assert solution.evaluation.arrival == (0, 0)
        assert solution.value == 0
    idle = make_profile(game, np.zeros((2, game.horizon, 2)))
    assert best_response(game, 0, idle).value == 0
