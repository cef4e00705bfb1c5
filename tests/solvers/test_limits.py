"""Time limits: the result is a feasible plan, or the status that there is none."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import evaluate, make_game, straight_plan
from solvers import (
    Status,
    best_response,
    best_response_dynamics,
    potential_equilibrium,
    social_optimum,
)
from tests.marks import first

LIMITS = first(2, (0.0, 0.05, 0.01, 0.2, 0.5))
HARD = {"speed": "l1", "objective": "risk", "gain": 0.0}
JOINT = {"social": social_optimum, "potential": potential_equilibrium}
CASES = [("intersection", "HIGHS"), ("intersection3", "HIGHS"), ("intersection", "SCIP")]
MODULES = {"HIGHS": "highspy", "SCIP": "pyscipopt"}


def respond(game, **options):
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    return best_response(game, 0, straight, **options)


def assert_no_plan_or_a_sound_one(game, solution, movers=None):
    if solution.profile is None:
        assert solution.status is Status.NO_INCUMBENT
        assert "time limit" in solution.advice
        assert solution.evaluation is None
        assert solution.value == np.inf
        assert solution.regret is None
    else:
        assert solution.status in (Status.FEASIBLE, Status.OPTIMAL)
        assert evaluate(game, solution.profile).violations(movers) == ()
        assert solution.evaluation.violations(movers) == ()
        assert np.isfinite(solution.value)
        assert solution.bound <= solution.value + 1e-6
    assert solution.bound >= 0  # costs are shifted


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize(("name", "solver"), CASES)
def test_a_best_response_cut_short_is_sound(name, limit, solver):
    pytest.importorskip(MODULES[solver])
    game = make_game(name, **HARD)
    solution = respond(game, solver=solver, time_limit=limit)
    assert_no_plan_or_a_sound_one(game, solution, (0,))


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize(("name", "solver"), CASES)
@pytest.mark.parametrize("planner", JOINT)
def test_a_program_over_all_agents_cut_short_is_sound(name, planner, limit, solver):
    pytest.importorskip(MODULES[solver])
    game = make_game(name, **HARD)
    solution = JOINT[planner](game, solver=solver, time_limit=limit)
    assert_no_plan_or_a_sound_one(game, solution)
    if solution.profile is not None and planner == "potential":
        assert (solution.regret >= 0).all()
        assert np.isfinite(solution.regret).all()


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("start", ["straight", "sequential"])
@pytest.mark.parametrize("name", ["intersection", "intersection3"])
def test_dynamics_cut_short_are_sound(name, start, limit):
    game = make_game(name, **HARD)
    solution = best_response_dynamics(game, start=start, time_limit=limit)
    assert solution.status in (Status.NO_INCUMBENT, Status.NOT_CONVERGED, Status.EQUILIBRIUM)
    if solution.profile is None:
        assert solution.evaluation is None
    else:
        assert evaluate(game, solution.profile).violations() == ()
    if solution.status is Status.EQUILIBRIUM:
        assert solution.regret.max() <= 1e-5
    else:
        assert solution.regret is None or (solution.regret >= 0).all()


def test_no_time_at_all_is_still_an_answer_with_a_bound():
    game = make_game("intersection3", **HARD)
    solution = social_optimum(game, time_limit=0.0)
    assert solution.status is Status.NO_INCUMBENT
    earliest = [12, 12, 9]  # L1 distances of 117, 120 and 85 at speed 10
    assert 0 <= solution.bound <= 0.5 * sum(earliest) + 1e-6  # and hardly any loss


def test_a_limit_that_is_long_enough_changes_nothing():
    game = make_game("intersection")
    free, limited = social_optimum(game), social_optimum(game, time_limit=600.0)
    assert limited.status is Status.OPTIMAL
    assert limited.value == free.value


def test_a_cut_search_keeps_a_true_lower_bound():
    game = make_game("intersection", **HARD)
    best = social_optimum(game)
    assert best.status is Status.OPTIMAL
    for limit in (0.1, 0.5):
        assert social_optimum(game, time_limit=limit).bound <= best.value + 1e-6


@pytest.mark.slow
def test_many_agents_without_a_plan_in_time_are_not_searched_exactly():
    """That search looks through all vectors of arrivals before it looks at the clock."""
    solution = social_optimum(make_game("circle(16)", objective="risk", lam=0.8), time_limit=0.0)
    assert solution.status is Status.NO_INCUMBENT
    assert solution.profile is None


@pytest.mark.parametrize("planner", [social_optimum, potential_equilibrium])
@pytest.mark.parametrize("name", first(1, ["streams(4)", "circle(5)"]))
def test_four_and_five_agents_have_plans_long_before_a_proof(name, planner):
    solution = planner(make_game(name, speed="l1"), node_limit=50)
    assert solution.status is Status.FEASIBLE
    assert evaluate(solution.game, solution.profile).feasible
    assert solution.bound <= solution.value


def test_dynamics_begin_otherwise_where_straight_lines_leave_no_way():
    game = make_game("circle(5)", speed="l1")
    assert best_response_dynamics(game, start="straight").status is Status.INFEASIBLE
    assert best_response_dynamics(game).status is Status.EQUILIBRIUM


@pytest.mark.slow
def test_no_joint_plan_costs_more_than_the_equilibrium_it_began_with():
    game = make_game("circle(6)", speed="l1", horizon=20)
    selfish = best_response_dynamics(game, max_sweeps=6)
    social = social_optimum(game, node_limit=2000)
    assert social.evaluation.social_cost <= selfish.evaluation.social_cost + 1e-6
