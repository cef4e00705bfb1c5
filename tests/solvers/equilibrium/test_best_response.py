"""Best responses: what they answer, what they ignore, and how they fail."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import InputError, evaluate, make_game, make_plan, make_profile, straight_plan
from solvers import Status, best_response
from tests.marks import first


def straight(game):
    return tuple(straight_plan(agent, game.horizon) for agent in game.agents)


@pytest.mark.parametrize("objective", ["margin", "risk"])
def test_only_the_agents_own_plan_changes_and_its_old_one_does_not_matter(objective):
    game = make_game("intersection3", objective=objective)
    profile = straight(game)
    idle = make_plan(game.agents[1], np.zeros((game.horizon, 2)))
    first = best_response(game, 1, profile)
    other = best_response(game, 1, (profile[0], idle, profile[2]))
    assert first.value == pytest.approx(other.value, abs=1e-6)
    for solution in (first, other):
        assert solution.profile[0] == profile[0]
        assert solution.profile[2] == profile[2]
        assert solution.minimised == "shifted_cost[1]"


def test_the_others_may_overlap_among_themselves():
    game = make_game("intersection3")
    profile = straight(game)
    assert evaluate(game, profile).violations((1, 2))
    solution = best_response(game, 0, profile)
    assert solution.status is Status.OPTIMAL
    assert solution.evaluation.violations((0,)) == ()


@pytest.mark.parametrize("name", first(1, ["head_on", "intersection"]))
@pytest.mark.parametrize("lam", [[0.2, 0.7], [0.6, 0.6]])
def test_pigou_adds_the_harm_to_the_other(name, lam):
    game = make_game(name, speed="l1", lam=lam, noise=4.0, margin_cap=6.0)
    solution = best_response(game, 0, straight(game), charge="pigou")
    judged = solution.evaluation
    time = lam[0] * judged.arrival[0]
    loss = (judged.shifted_cost[0] - time) / (1 - lam[0])
    assert loss > 0
    assert solution.value == pytest.approx(time + (2 - sum(lam)) * loss, abs=1e-6)
    selfish = best_response(game, 0, straight(game))
    assert selfish.value <= judged.shifted_cost[0] + 1e-6
    assert selfish.evaluation.shifted_cost[1] >= judged.shifted_cost[1] - 1e-6


def test_an_agent_that_does_not_mind_time_is_as_safe_as_it_can_be():
    game = make_game("head_on", speed="l1", lam={0: 0.0}, horizon=18)
    solution = best_response(game, 0, straight(game))
    assert solution.value == pytest.approx(0, abs=1e-6)
    assert solution.evaluation.deficit[0] == pytest.approx(0, abs=1e-6)


def test_a_goal_out_of_reach_names_the_agent_and_the_horizon_that_would_do():
    game = make_game("head_on", horizon=8, goal={1: [75.0, 50.0]})
    profile = make_profile(game, np.zeros((2, 8, 2)))
    solution = best_response(game, 0, profile)
    assert solution.status is Status.UNREACHABLE
    assert solution.profile is None
    assert "agent_0" in solution.advice
    assert "9" in solution.advice


def test_a_goal_that_no_horizon_reaches_asks_for_larger_controls():
    game = make_game("head_on", goal={0: [1e5, 50.0]})
    solution = best_response(game, 0, make_profile(game, np.zeros((2, game.horizon, 2))))
    assert solution.status is Status.UNREACHABLE
    assert "larger controls" in solution.advice


def test_a_start_that_another_drives_over_is_infeasible():
    # The other comes faster than this agent can step aside, and the time is just enough.
    game = make_game("head_on", speed="l1", horizon=9)
    solution = best_response(game, 0, straight(game))
    assert solution.status is Status.INFEASIBLE
    assert solution.profile is None
    assert "overlap" in solution.advice


@pytest.mark.parametrize("agent", [-1, 2, 17])
def test_an_agent_that_is_not_in_the_game_is_refused(agent):
    game = make_game("head_on")
    with pytest.raises(InputError, match="agent"):
        best_response(game, agent, straight(game))


@pytest.mark.parametrize("profile", [None, ()])
def test_the_others_plans_are_needed(profile):
    with pytest.raises(InputError, match="plan"):
        best_response(make_game("head_on"), 0, profile)


@pytest.mark.parametrize("option", [{"charge": "double"}, {"solver": "ABACUS"}])
def test_an_unknown_option_is_refused(option):
    game = make_game("head_on")
    with pytest.raises(InputError):
        best_response(game, 0, straight(game), **option)


def test_one_agent_alone_needs_no_profile():
    game = make_game("course")
    assert best_response(game, 0).status is Status.OPTIMAL
