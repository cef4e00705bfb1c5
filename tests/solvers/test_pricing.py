"""Pricing: what controls cost, whether they are feasible, and predictions left as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from ppg_env import evaluate, make_game, straight_plan
from ppg_env.game import objective
from ppg_env.support.frozen import frozen_array
from solvers import social_optimum
from solvers.pricing import price, price_profile
from tests.ppg_env.strategies import plays


@settings(max_examples=25)
@given(plays())
def test_a_profile_is_feasible_if_and_only_if_no_constraint_is_reported(play):
    evaluation = evaluate(play.game, play.profile)
    agents = range(len(play.game.agents))
    assert evaluation.feasible == (not evaluation.violations())
    for i in agents:
        assert evaluation.is_feasible((i,)) == (not evaluation.violations((i,)))
    priced = price_profile(objective.social(play.game), play.profile)
    assert (priced is not None) == evaluation.feasible
    if priced is not None:
        assert priced.profile == play.profile
        assert priced.value == evaluation.weighted(objective.social(play.game))


def test_a_price_is_the_evaluators_value_of_any_objective():
    game = make_game("intersection3")
    profile = social_optimum(game).profile
    evaluation = evaluate(game, profile)
    for i in range(3):
        priced = price_profile(objective.selfish(game, i), profile)
        assert priced.value == pytest.approx(evaluation.shifted_cost[i])
    assert price_profile(objective.potential(game), profile).value == pytest.approx(
        evaluation.potential
    )


def test_only_constraints_of_moving_agents_count_and_given_means_are_taken_as_they_are():
    game = make_game("intersection3")
    straight = [straight_plan(agent, game.horizon) for agent in game.agents]
    assert evaluate(game, tuple(straight)).violations((1, 2))
    predicted = replace(straight[2], means=frozen_array(straight[2].means + 500.0))
    others = {1: predicted, 2: predicted}
    priced = price(objective.selfish(game, 0), {0: straight[0].controls}, others)
    assert priced is not None
    assert priced.profile[1] is predicted
    assert priced.value == game.agents[0].lam * straight[0].arrival


def test_controls_that_miss_the_goal_have_no_price():
    game = make_game("parallel")
    idle = np.zeros((game.horizon, 2))
    assert price(objective.social(game), {0: idle, 1: idle}, {}) is None
