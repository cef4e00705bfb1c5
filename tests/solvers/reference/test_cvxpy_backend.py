"""Back ends: one optimum on each of them, and nothing believed that they did not prove."""

from __future__ import annotations

import cvxpy as cp
import numpy as np
import pytest

from ppg_env import InputError, make_game
from solvers import Status, best_response_dynamics
from solvers.reference.cvxpy_backend import check_backend, solve
from tests.marks import first

OTHERS = {"SCIP": "pyscipopt", "GUROBI": "gurobipy"}


@pytest.mark.parametrize("solver", first(1, ["HIGHS", "SCIP"]))
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
