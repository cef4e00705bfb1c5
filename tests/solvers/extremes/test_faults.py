"""Wrong claims and limits: the intervals stay valid, and become wide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import make_game
from ppg_env.game.objective import social
from solvers import best_response, best_response_dynamics, equilibrium_bounds
from solvers.budget import Budget
from solvers.extremes.arrival_vectors import ArrivalVector
from solvers.extremes.coarse_limits import largest_cost
from solvers.extremes.pair_program import PairProgram
from solvers.extremes.rows import Outcome, Rows
from tests.solvers.extremes.test_line_equilibria import GAMES

GAME = GAMES["follow"].game
ONLY = 4.8
"""Social cost of all its equilibria."""


@pytest.mark.parametrize("claim", [Outcome.NONE, Outcome.STOPPED])
def test_whatever_the_back_end_claims_known_equilibria_are_inside(monkeypatch, claim):
    monkeypatch.setattr(Rows, "point", lambda *arguments: (claim, np.zeros(0)))
    bounds = equilibrium_bounds(GAME, runs=2)
    assert bounds.best.low <= ONLY == pytest.approx(bounds.best.high)
    assert bounds.worst.low == pytest.approx(ONLY)
    assert bounds.worst.high >= ONLY


def test_proofs_that_a_known_equilibrium_refutes_are_not_used(monkeypatch):
    def excluded(vector: ArrivalVector, goal: float, budget: Budget) -> None:
        vector.most = -np.inf

    monkeypatch.setattr(ArrivalVector, "lower", excluded)
    bounds = equilibrium_bounds(GAME, runs=2)
    assert bounds.worst.high == largest_cost(GAME)
    assert bounds.best.low <= ONLY


def test_without_time_the_intervals_hold():
    bounds = equilibrium_bounds(GAME, time_limit=0.0)
    assert bounds.best.low <= ONLY <= bounds.worst.high
    assert bounds.best.high >= ONLY >= bounds.worst.low


@pytest.mark.parametrize("changes", [{"collisions": "swept"}, {"on_goal": "stay"}])
def test_other_games_get_coarse_limits(changes):
    bounds = equilibrium_bounds(replace(GAME, **changes), runs=1)
    assert not bounds.refined
    assert bounds.best.low <= bounds.best.high <= bounds.worst.low <= bounds.worst.high
    assert np.isfinite(bounds.worst.high)


def test_the_coarse_limit_bounds_what_plans_cost():
    game = make_game("intersection", speed="l1")
    for start in ("straight", "sequential"):
        plans = best_response_dynamics(game, start=start).evaluation
        assert plans.weighted(social(game)) <= largest_cost(game)


@pytest.mark.parametrize("objective", ["margin", pytest.param("risk", marks=pytest.mark.slow)])
def test_a_known_equilibrium_satisfies_the_inequality_of_every_deviation(objective):
    """Its controls are fixed in the program; deviations respond to other plans."""
    game = make_game("intersection", speed="l1", horizon=13, objective=objective)
    known = best_response_dynamics(game)
    program = PairProgram(game, known.evaluation.arrival, epsilon=1e-4)
    others = [
        best_response_dynamics(game, start="sequential", order=order).profile
        for order in ((0, 1), (1, 0))
    ]
    for profile in (known.profile, *others):
        for i in (0, 1):
            program.add_deviation(i, best_response(game, i, profile).profile[i])
    for columns, plan in zip(program._controls, known.profile, strict=True):
        for column, value in zip(columns.ravel(), plan.controls.ravel(), strict=False):
            program._rows.row({int(column): 1.0}, value - 1e-7, value + 1e-7)
    evaluation = known.evaluation
    spent = sum(0.5 * arrival for arrival in evaluation.arrival)
    losses = evaluation.social_cost - spent  # lam = 0.5: the pair's losses count once in all
    outcome, _, _ = program.profile(losses - 1e-3, losses + 1e-3, Budget(None), 1000)
    assert outcome is Outcome.POINT
