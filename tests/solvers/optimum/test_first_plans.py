"""Joint searches that are cut short: plans from best responses, descents, and regrets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, evaluate
from ppg_env.game import objective
from solvers import best_response_dynamics, certify, potential_equilibrium, social_optimum
from solvers.budget import Budget
from solvers.engine.arrival_search import engine_search
from solvers.solution import Status
from tests.marks import first
from tests.oracles.mixed_games import mixed_game


def merge(collisions="instants") -> Game:
    """Two cars that merge into one lane next to a ramp."""
    control = Polytope.from_vertices([[0, -1.5], [6, -1.5], [6, 1.5], [0, 1.5]])
    body = Polytope.box([4.5, 2.0])
    ways = [([0.0, 1.75], [48.0, 5.25]), ([0.0, 5.25], [48.0, 5.25])]
    sides = [[[-20, -3], [80, -3], [80, 0], [-20, 0]], [[-20, 7], [80, 7], [80, 10], [-20, 10]]]
    ramp = [[25, 0], [35, 3.5], [80, 3.5], [80, 0]]
    return Game(
        tuple(Agent(*way, body, control, lam=0.6, gain=0.5, noise=0.02) for way in ways),
        tuple(Polytope.from_vertices(corners) for corners in (*sides, ramp)),
        horizon=12,
        objective="risk",
        collisions=collisions,
    )


@pytest.mark.parametrize("collisions", first(1, ["instants", "swept"]))
@pytest.mark.parametrize("planner", first(1, [social_optimum, potential_equilibrium]))
def test_among_walls_the_plans_of_best_responses_are_there_from_the_start(planner, collisions):
    game = merge(collisions)
    nash = best_response_dynamics(game)
    assert nash.status is Status.EQUILIBRIUM
    reported = []
    solution = planner(
        game, node_limit=1, progress=lambda what, value: reported.append((what, value))
    )
    assert solution.profile is not None
    assert evaluate(game, solution.profile).violations() == ()
    assert reported[0][0] == "value"
    dearest = (
        nash.evaluation.social_cost if planner is social_optimum else nash.evaluation.potential
    )
    assert solution.value <= dearest + 1e-4
    assert solution.bound <= solution.value


@pytest.mark.parametrize("nodes", first(2, [1, 30, 100]))
def test_the_regret_of_a_search_cut_short_is_no_looser_than_the_gap_of_the_potential(nodes):
    game = merge()
    one, other = game.agents
    game = replace(game, agents=(replace(one, lam=0.3), replace(other, lam=0.8)))
    solution = potential_equilibrium(game, node_limit=nodes)
    care = np.array([0.7, 0.2])
    assert (solution.regret <= care * (solution.value - solution.bound) + 1e-7).all()
    assert (solution.regret >= certify(game, solution.profile).regret - 1e-6).all()


@pytest.mark.slow
def test_descents_from_incumbents_find_what_the_search_alone_does_not(monkeypatch):
    weights = objective.social(mixed_game(6, in_motion=True).game)
    alone = engine_search(weights, (0, 1), None, Budget(None, 1500))
    monkeypatch.setattr("solvers.engine.arrival_search.DESCENT_AFTER", 500)
    descended = engine_search(weights, (0, 1), None, Budget(None, 1500))
    assert alone.value > 400
    assert descended.value == pytest.approx(98.0328, abs=1e-2)  # as HiGHS finds in 20 s
    assert descended.bound <= descended.value
