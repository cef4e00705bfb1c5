"""Faults injected into the back ends: nothing is called proved that is not."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import inf, nan
from types import SimpleNamespace

import cvxpy as cp
import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, evaluate
from ppg_env.game import objective
from solvers import best_response, best_response_dynamics, social_optimum
from solvers.budget import Budget
from solvers.engine.arrival_search import engine_search
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.node_lp import Relaxation
from solvers.pricing import PricedProfile
from solvers.reference import cvxpy_backend as backend
from solvers.search_result import REFUTED, REJECTED, UNPROVED, Claims, conclude
from solvers.solution import Solution, Status
from tests.marks import first

BODY, SPEED = Polytope.box([2.0, 2.0]), Polytope.l1(3.0)
WAYS = (([-4.0, 0.0], [4.0, 0.5]), ([4.0, 0.0], [-4.0, 0.0]))
GAME = Game(
    tuple(Agent(*way, BODY, SPEED, lam=0.8, noise=0.1) for way in WAYS), horizon=5, margin_cap=2.0
)
OPTIMUM = engine_search(objective.social(GAME), (0, 1), None, Budget(None))


def plans(value):
    """Plans to which an evaluator gives ``value``."""
    return PricedProfile(OPTIMUM.profile, OPTIMUM.evaluation, value)


@pytest.mark.parametrize(
    ("value", "claims", "status", "bound"),
    [
        (10.0, Claims(10.0, complete=True), Status.OPTIMAL, 10.0),
        (10.0, Claims(10.0 + 1e-7, complete=True), Status.OPTIMAL, 10.0),
        (10.0, Claims(10.0, complete=False), Status.OPTIMAL, 10.0),
        (1e6, Claims(1e6 - 0.5, complete=True), Status.OPTIMAL, 1e6 - 0.5),
        (1e6, Claims(1e6 + 0.5, complete=True), Status.OPTIMAL, 1e6),
        (10.0, Claims(9.2, complete=True), Status.FEASIBLE, 9.2),
        (10.0, Claims(9.2, complete=False), Status.FEASIBLE, 9.2),
        (10.0, Claims(10.3, complete=True), Status.FEASIBLE, 4.0),
        (10.0, Claims(inf, complete=True), Status.FEASIBLE, 4.0),
        (10.0, Claims(nan, complete=True), Status.FEASIBLE, 4.0),
        (10.0, Claims(10.0, complete=True, refuted=True), Status.FEASIBLE, 4.0),
        (nan, Claims(9.0, complete=True), Status.ERROR, 4.0),
        (None, Claims(inf, complete=True), Status.INFEASIBLE, inf),
        (None, Claims(inf, complete=True, rejected=True), Status.ERROR, 4.0),
        (None, Claims(inf, complete=True, failed=True), Status.ERROR, 4.0),
        (None, Claims(5.0, complete=False), Status.NO_INCUMBENT, 5.0),
        (None, Claims(nan, complete=False), Status.NO_INCUMBENT, 4.0),
    ],
)
def test_status_and_bound_are_what_claims_and_evaluator_prove(value, claims, status, bound):
    result = conclude(None if value is None else plans(value), claims, 4.0)
    assert result.status is status
    assert result.bound == bound


def test_the_advice_says_why_nothing_is_proved():
    for claims, detail in (
        (Claims(9.2, complete=True), UNPROVED),
        (Claims(10.3, complete=True), REFUTED),
    ):
        assert conclude(plans(10.0), claims, 4.0).detail == detail
    assert conclude(None, Claims(5.0, complete=True, rejected=True)).detail == REJECTED


def solved_with(monkeypatch, change):
    """Let ``change`` alter every value and point that the engine's linear programs return."""
    solve, random = Relaxation.solve, np.random.default_rng(0)

    def changed(self, cutoff=inf):
        solution = solve(self, cutoff)
        return solution if solution is None or solution[0] == inf else change(*solution, random)

    monkeypatch.setattr(Relaxation, "solve", changed)
    return engine_search(objective.social(GAME), (0, 1), None, Budget(None, 3000))


def is_honest(result):
    """Whether status, value and bound fit each other and the true optimum."""
    assert result.bound <= OPTIMUM.value + 1e-6
    assert result.status is not Status.INFEASIBLE
    if result.profile is not None:
        assert evaluate(GAME, result.profile).feasible
    if result.status is Status.OPTIMAL:
        assert result.value == pytest.approx(OPTIMUM.value, abs=1e-5)
        assert result.value - result.bound <= 1e-6 * max(1.0, result.value)
    return True


def test_a_bound_that_plans_refute_is_thrown_away(monkeypatch):
    result = solved_with(monkeypatch, lambda value, point, random: (value + 0.3, point))
    assert is_honest(result)
    assert result.status is Status.FEASIBLE
    assert result.detail == REFUTED


@pytest.mark.parametrize("size", [1e-7, 1e-5, 1e-3])
def test_points_that_are_a_little_off_are_never_proved_optimal_with_a_gap(monkeypatch, size):
    def change(value, point, random):
        return value, point + size * random.normal(size=len(point))

    assert is_honest(solved_with(monkeypatch, change))


def test_points_that_the_evaluator_rejects_do_not_make_a_game_infeasible(monkeypatch):
    monkeypatch.setattr(FixedProgram, "controls_at", lambda self, point: {
        i: np.full((GAME.horizon, 2), 1e3) for i in self.controls
    })  # fmt: skip
    result = engine_search(objective.social(GAME), (0, 1), None, Budget(None, 3000))
    assert result.status is Status.ERROR
    assert result.profile is None
    assert result.bound <= OPTIMUM.value


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_numbers_of_the_linear_program_that_are_not_finite_are_a_failure(monkeypatch, share):
    import highspy

    class Broken(highspy.Highs):
        """A back end that returns NaN now and then."""

        random = np.random.default_rng(0)

        def getSolution(self):  # noqa: N802  # highspy's name
            solution = super().getSolution()
            if self.random.random() >= share:
                return solution
            lost = [nan] * len(solution.col_value)
            return SimpleNamespace(col_value=lost, col_dual=lost)

    monkeypatch.setattr(highspy, "Highs", Broken)
    result = engine_search(objective.social(GAME), (0, 1), None, Budget(None, 3000))
    assert is_honest(result)
    if share == 1.0:
        assert result.status is Status.ERROR
        assert np.isfinite(result.bound)


def answering(monkeypatch, change):
    """Let ``change`` alter every answer of the MILP back end."""
    solve = backend.solve
    monkeypatch.setattr(backend, "solve", lambda *arguments: change(solve(*arguments)))


def test_a_bound_of_a_milp_solver_above_the_value_of_its_plans_is_thrown_away(monkeypatch):
    answering(monkeypatch, lambda answer: replace(answer, bound=answer.bound + 0.3))
    solution = social_optimum(GAME, solver="HIGHS")
    assert solution.status is Status.FEASIBLE
    assert solution.bound <= OPTIMUM.value
    assert solution.advice == REFUTED
    assert solution.gap > 0


def test_a_false_infeasible_makes_no_false_equilibrium(monkeypatch):
    start = best_response_dynamics(GAME, max_sweeps=1).profile
    answering(monkeypatch, lambda answer: backend.Answer("infeasible", inf, "infeasible"))
    nash = best_response_dynamics(GAME, start=start, solver="HIGHS", max_sweeps=2)
    assert nash.status is Status.NOT_CONVERGED
    response = best_response(GAME, 0, start, solver="HIGHS")
    assert response.status is Status.FEASIBLE
    assert response.value == pytest.approx(evaluate(GAME, start).shifted_cost[0])


FAILURES = (ValueError, KeyError, RuntimeError, ZeroDivisionError, IndexError, cp.error.SolverError)
PLANNERS = (
    lambda: social_optimum(GAME, solver="HIGHS"),
    lambda: best_response_dynamics(GAME, solver="HIGHS", start="straight", max_sweeps=2),
)


@pytest.mark.parametrize(("failure", "plan"), list(product(FAILURES, PLANNERS)))
def test_no_exception_of_the_back_end_escapes(monkeypatch, failure, plan):
    def broken(self, **options):
        raise failure("broken")

    monkeypatch.setattr(cp.Problem, "solve", broken)
    solution = plan()
    assert solution.status is Status.ERROR
    assert "broken" in solution.advice


@pytest.mark.parametrize("number", [nan, inf, None])
@pytest.mark.parametrize("where", ["variables", "value", "bound"])
@pytest.mark.parametrize("plan", first(1, PLANNERS))
def test_numbers_of_the_back_end_that_are_not_finite_are_a_failure(
    monkeypatch, number, where, plan
):
    solve = cp.Problem.solve

    def broken(self, **options):
        solve(self, **options)
        if where == "variables":
            for variable in self.variables():
                variable.save_value(None if number is None else np.full(variable.shape, number))
        elif where == "value":
            self._value = number
        else:
            self._solver_stats.extra_stats = SimpleNamespace(mip_dual_bound=number)

    monkeypatch.setattr(cp.Problem, "solve", broken)
    if where == "bound":  # without a bound, the MILP is solved until the limit on rounds
        monkeypatch.setattr("solvers.reference.solve.ROUNDS", 2)
    solution: Solution = plan()
    assert solution.status is not Status.INFEASIBLE
    assert solution.minimised is None or solution.bound <= OPTIMUM.value + 1e-6
    if where != "bound":
        assert solution.status is Status.ERROR
        assert solution.profile is None
