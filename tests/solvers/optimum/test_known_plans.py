"""Plans that are known before the search for the social optimum."""

from __future__ import annotations

import pytest

from ppg_env import make_game
from solvers import best_response_dynamics, social_optimum
from tests.marks import first
from tests.solvers.walled_games import walled_game


@pytest.mark.parametrize("kind", first(1, ["bend", "alcove"]))
def test_an_optimum_costs_no_more_than_known_plans_even_without_time(kind):
    game = walled_game(kind, 0)
    known = best_response_dynamics(game, time_limit=20)
    solution = social_optimum(game, start=known.profile, time_limit=0.0)
    assert solution.evaluation.social_cost <= known.evaluation.social_cost + 1e-9
    assert solution.bound <= solution.value


@pytest.mark.slow
def test_known_plans_are_improved():
    game = make_game("circle(6)")
    known = best_response_dynamics(game, max_sweeps=1)
    solution = social_optimum(game, start=known.profile, node_limit=300)
    assert solution.value <= known.evaluation.social_cost


def test_plans_that_overlap_are_no_start():
    game = make_game("head_on")
    plan = best_response_dynamics(game).profile[0]
    crossing = (plan, plan)
    assert social_optimum(game, start=crossing).value == social_optimum(game).value
