"""Back ends: one optimum on each of them, and nothing believed that they did not prove."""

from __future__ import annotations

from functools import cache

import cvxpy as cp
import numpy as np
import pytest

from ppg_env import InputError, evaluate, make_game, straight_plan
from solvers import Status, best_response, best_response_dynamics, social_optimum
from solvers.reference.cvxpy_backend import check_backend, solve

TWO_AGENTS = ("opposing", "head_on", "parallel", "intersection")
OTHERS = {"SCIP": "pyscipopt", "GUROBI": "gurobipy"}
TOO_LARGE = "too large for the size-limited licence of Gurobi"


def cases():
    """The paper's scenarios; of the slow ones, risk with the L1 ball, one."""
    found = [(n, s, o) for n in TWO_AGENTS for s in ("box", "l1") for o in ("margin", "risk")]
    return [case for case in found if case[1:] != ("l1", "risk") or case[0] == "opposing"]


@cache
def on_highs(game):
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    return straight, social_optimum(game), best_response(game, 0, straight)


@pytest.mark.parametrize(("name", "speed", "objective"), cases())
@pytest.mark.parametrize("solver", OTHERS)
def test_every_back_end_finds_the_same_social_optimum_and_best_response(
    solver, name, speed, objective
):
    pytest.importorskip(OTHERS[solver])
    game = make_game(name, objective=objective, speed=speed)
    straight, social, response = on_highs(game)
    other = social_optimum(game, solver=solver)
    if solver == "GUROBI" and other.status is Status.ERROR:
        pytest.skip(TOO_LARGE)
    assert other.status is Status.OPTIMAL
    assert other.value == pytest.approx(social.value, rel=1e-6)
    assert other.bound == pytest.approx(social.bound, rel=1e-6)
    there = best_response(game, 0, straight, solver=solver)
    assert there.value == pytest.approx(response.value, rel=1e-6)
    assert evaluate(game, there.profile).violations((0,)) == ()


def test_three_agents_have_one_optimum_on_both_back_ends():
    pytest.importorskip("pyscipopt")
    game = make_game("intersection3")
    assert social_optimum(game, solver="scip").value == pytest.approx(
        social_optimum(game).value, rel=1e-6
    )


@pytest.mark.parametrize("solver", ["HIGHS", "SCIP"])
def test_dynamics_reach_an_equilibrium_on_either_back_end(solver):
    if solver == "SCIP":
        pytest.importorskip("pyscipopt")
    solution = best_response_dynamics(make_game("head_on", speed="l1"), solver=solver)
    assert solution.status is Status.EQUILIBRIUM
    assert solution.regret.max() <= 1e-5


@pytest.mark.parametrize("solver", ["HIGHS", *OTHERS])
def test_an_infeasible_problem_is_infeasible_on_every_back_end(solver):
    if solver in OTHERS:
        pytest.importorskip(OTHERS[solver])
    x = cp.Variable(2, boolean=True)
    answer = solve(cp.Problem(cp.Minimize(cp.sum(x)), [x[0] + x[1] == 1.5]), solver, None)
    assert answer.outcome == "infeasible"
    assert not answer.has_point


@pytest.mark.parametrize("solver", ["HIGHS", *OTHERS])
def test_an_optimum_comes_with_a_bound_equal_to_it(solver):
    if solver in OTHERS:
        pytest.importorskip(OTHERS[solver])
    x = cp.Variable(3, integer=True)
    problem = cp.Problem(cp.Minimize(x @ [3.0, 2.0, 4.0]), [x >= 0, cp.sum(x) >= 2.5])
    answer = solve(problem, solver, None)
    assert answer.outcome == "optimal"
    assert problem.value == pytest.approx(6.0)
    assert answer.bound == pytest.approx(6.0)


def even_split(size=35, seed=0):
    """Split large numbers into equal sums: easy to start, hard to finish, next to 0 at best."""
    weights = np.random.default_rng(seed).integers(10**6, 10**7, size)
    take, miss = cp.Variable(size, boolean=True), cp.Variable(nonneg=True)
    half = float(weights.sum()) / 2
    both = [weights @ take - half <= miss, half - weights @ take <= miss]
    return cp.Problem(cp.Minimize(miss), both), take


@pytest.mark.parametrize("limit", [0.0, 0.01, 0.05, 0.3])
@pytest.mark.parametrize("solver", ["HIGHS", *OTHERS])
def test_at_a_time_limit_a_bound_is_a_bound_and_a_point_is_a_point(solver, limit):
    if solver in OTHERS:
        pytest.importorskip(OTHERS[solver])
    problem, take = even_split()
    answer = solve(problem, solver, limit)
    assert answer.outcome in ("optimal", "incumbent", "none")
    # 2^35 sums below 4e8 leave gaps of hundredths: no true bound is far above zero.
    assert answer.bound <= 10
    if answer.has_point:
        np.testing.assert_allclose(take.value, np.round(take.value), atol=1e-6)
        assert set(np.round(take.value)) <= {0.0, 1.0}


@pytest.mark.parametrize("name", ["ABACUS", "CLARABEL", "", "highs!"])
def test_a_solver_that_cannot_take_the_programs_is_refused_with_those_that_can(name):
    with pytest.raises(InputError, match="HIGHS"):
        check_backend(name)


def test_a_solvers_name_may_be_written_in_small_letters():
    assert check_backend("highs") == "HIGHS"
