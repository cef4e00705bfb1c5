"""The engine on games that mix everything a game may have, whole and cut short."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import Polytope, evaluate, make_game
from ppg_env.game import objective
from ppg_env.game.input_sets import pieces
from ppg_env.game.reachability import earliest_arrival
from solvers import best_response, certify, potential_equilibrium, social_optimum
from solvers.budget import Budget
from solvers.engine.arrival_search import engine_search
from solvers.engine.symmetry import symmetries
from solvers.solution import Status
from tests.marks import first
from tests.oracles.mixed_games import mixed_game


def test_the_games_are_as_mixed_as_they_are_said_to_be():
    games = [mixed_game(seed).game for seed in range(60)]
    agents = [agent for game in games for agent in game.agents]
    assert {game.dim for game in games} == {1, 2, 3}
    assert {game.objective for game in games} == {"margin", "risk"}
    assert {len(pieces(agent.control)) for agent in agents} == {1, 2, 3}
    assert any(game.obstacles for game in games)
    for wanted in (
        lambda a: a.state_dim > a.dim,
        lambda a: a.goal.size < a.state_dim,
        lambda a: a.sigma0.any(),
        lambda a: np.count_nonzero(a.gain) > a.dim,
        lambda a: any(s.clearance(np.zeros(s.dim)) > 0 for _, s in pieces(a.control)),
        lambda a: any(s.vertices.shape[0] == 1 for _, s in pieces(a.control)),
    ):
        assert 5 < sum(bool(wanted(agent)) for agent in agents) < len(agents)


@pytest.mark.parametrize("seed", first(2, range(24)))
def test_plans_of_mixed_games_hold_and_no_agent_gains(seed):
    game = mixed_game(seed).game
    social, potential = social_optimum(game), potential_equilibrium(game)
    if social.status is Status.INFEASIBLE:
        assert potential.status is Status.INFEASIBLE
        return
    assert social.status is potential.status is Status.OPTIMAL
    assert potential.regret.max() <= 1e-5
    assert certify(game, social.profile, charge="pigou").epsilon <= 1e-5
    assert social.value <= potential.evaluation.social_cost + 1e-6
    for solution in (social, potential):
        assert solution.evaluation.feasible


@pytest.mark.parametrize("seed", first(3, range(30)))
def test_a_bound_never_passes_the_optimum_however_early_the_search_stops(seed):
    game = mixed_game(seed).game
    weights = objective.social(game)
    optimum = engine_search(weights, (0, 1), None, Budget(None))
    for nodes in (0, 1, 2, 3, 5, 8, 13, 21, 34):
        found = engine_search(weights, (0, 1), None, Budget(None, nodes))
        assert found.bound <= optimum.value + 1e-7
        if found.profile is not None:
            assert evaluate(game, found.profile).violations() == ()
            assert found.value >= optimum.value - 1e-7


WALLED = [0, 2, 3, 4, 7, 8, 13, 15, 16, 19, 21, 24]
"""Seeds of games with an obstacle."""


@pytest.mark.parametrize("seed", first(4, WALLED))
def test_what_obstacles_cost_each_alone_changes_no_optimum(seed, monkeypatch):
    game = mixed_game(seed).game
    assert game.obstacles
    weights = objective.social(game)
    plain = engine_search(weights, (0, 1), None, Budget(None))
    monkeypatch.setattr("solvers.engine.cuts.PATIENCE", 0)
    advised = engine_search(weights, (0, 1), None, Budget(None))
    assert advised.status is plain.status
    assert advised.value == pytest.approx(plain.value, rel=1e-7, abs=1e-7)
    assert advised.bound == pytest.approx(plain.bound, rel=1e-7, abs=1e-7)


def test_an_obstacle_that_is_costly_to_pass_is_priced_once_for_all_arrivals_of_the_other():
    # Time costs nothing here, so every arrival has to be proved; without the prices of walls the
    # bound is at 2.16 after 5,000 programs.
    game = mixed_game(509).game
    found = engine_search(objective.social(game), (0, 1), None, Budget(None, 3000))
    assert found.status is Status.OPTIMAL
    assert found.value == pytest.approx(2.4318487, abs=1e-6)  # as HiGHS found


@pytest.mark.parametrize("seed", first(8, range(30)))
def test_drawn_plans_are_no_better_than_a_response_and_arrive_no_earlier_than_possible(seed):
    mixed = mixed_game(seed)
    game, judged = mixed.game, evaluate(mixed.game, mixed.profile)
    for i, agent in enumerate(game.agents):
        assert mixed.profile[i].arrival >= earliest_arrival(agent, game.horizon)
        if not judged.violations((i,)):
            response = best_response(game, i, mixed.profile)
            near = 1e-6 * max(1.0, judged.shifted_cost[i])
            assert response.value <= judged.shifted_cost[i] + near


def test_symmetries_are_those_of_all_control_sets_at_their_times():
    box, tall = Polytope.box([20.0, 20.0]), Polytope.box([8.0, 12.0])
    counts = []
    for one, other in (
        (box, box),
        (((0, box), (4, box)), ((0, box), (4, box))),
        (((0, box), (4, box)), ((0, box), (5, box))),
        (((0, box), (4, tall)), ((0, box), (4, tall))),
        (((0, box), (4, box)), box),
    ):
        game = make_game("circle(4)", control={0: one, 1: other, 2: one, 3: other})
        counts.append(len(symmetries(objective.social(game))))
    assert counts == [8, 8, 4, 4, 4]
