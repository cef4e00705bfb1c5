from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numba
import numpy as np
import pytest

from ppg_env import make_game
from ppg_env.env.episodes import evaluate
from ppg_env.env.players import straight_players
from ppg_env.env.rules import Rules
from ppg_env.errors import InputError
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.polytope import Polytope
from solvers import best_feedback_response, feedback_equilibrium, feedback_optimum
from tests.marks import first
from tests.solvers.feedback.line_games import (
    KAPPA,
    LAM,
    NOISE,
    alone,
    line_agent,
    line_game,
    overlap,
)

ONE_STEP = Rules(max_cycles=1)
CRASH = (1 - LAM) * KAPPA


def facing(**more):
    """Two agents that must approach each other in their first step."""
    return line_game(line_agent(0.0, 200.0, 4.0, 8.0), line_agent(22.0, -200.0, -6.0, -2.0), **more)


def following(**more):
    """A fast agent behind one that is to stop after it."""
    return line_game(line_agent(0.0, 40.0), line_agent(25.0, 65.0, -6.0, 6.0), **more)


@pytest.mark.parametrize("solve", [feedback_optimum, feedback_equilibrium])
@pytest.mark.parametrize("on_crash", ["remove", "continue"])
def test_one_step_has_the_probability_of_the_closest_safe_actions(solve, on_crash):
    solution = solve(facing(), Rules(max_cycles=1, on_crash=on_crash))
    assert solution.value == pytest.approx([LAM + CRASH * overlap(16.0)] * 2, rel=0.02)
    assert solution.stages == 1


def test_a_swept_step_counts_those_who_cross():
    game = line_game(
        line_agent(0.0, 200.0, 19.0, 20.0), line_agent(22.0, -200.0, -20.0, -19.0),
        collisions="swept",
    )  # fmt: skip
    assert feedback_optimum(game, ONE_STEP).value == pytest.approx([LAM + CRASH] * 2, rel=1e-3)
    swept = feedback_optimum(facing(collisions="swept"), ONE_STEP).value
    assert swept == pytest.approx([LAM + CRASH * overlap(16.0)] * 2, rel=0.05)


def test_an_obstacle_costs_its_probability():
    wall = Obstacle(Polytope.from_vertices([[20.0], [30.0]]))
    game = line_game(
        line_agent(0.0, 200.0, 10.0, 10.5), line_agent(500.0, 300.0), obstacles=(wall,)
    )
    expected = LAM + CRASH * overlap(17.5, NOISE)
    assert feedback_optimum(game, ONE_STEP).value[0] == pytest.approx(expected, rel=0.02)


def test_agents_far_apart_cost_what_each_costs_alone():
    game = line_game(line_agent(0.0, 40.0), line_agent(1000.0, 1033.0))
    exact = [alone(0.0, 40.0, 20), alone(1000.0, 1033.0, 20)]
    for solve in (feedback_optimum, feedback_equilibrium):
        assert solve(game).value == pytest.approx(exact, rel=0.01)
    halved = feedback_optimum(game, step=1.25).value
    assert halved == pytest.approx(exact, rel=0.003)


@pytest.mark.nightly
@pytest.mark.slow
def test_a_response_to_a_blind_player_is_no_worse_than_its_own_plan():
    game = following()
    players = straight_players(game)
    response = best_feedback_response(game, 0, players)
    before = evaluate(game, players, 4096, seed=5).cost[:, 0]
    after = evaluate(game, response.players(), 4096, seed=5).cost[:, 0]
    assert (before - after).mean() > 4 * (before - after).std() / 64
    assert response.value[0] == pytest.approx(after.mean(), rel=0.03)


@pytest.mark.nightly
@pytest.mark.slow
def test_a_response_to_the_optimum_gains_and_to_an_equilibrium_does_not():
    game = following()
    optimum, equilibrium = feedback_optimum(game), feedback_equilibrium(game)
    assert equilibrium.without_equilibrium < 0.02
    for agent in range(2):
        response = best_feedback_response(game, agent, equilibrium.players())
        played = evaluate(game, equilibrium.players(), 8192, seed=2).cost[:, agent]
        deviating = evaluate(game, response.players(), 8192, seed=2).cost[:, agent]
        assert (played - deviating).mean() < 0.02 * played.mean()
    social = [
        evaluate(game, s.players(), 8192, seed=3).cost.sum(axis=1) for s in (optimum, equilibrium)
    ]
    assert (social[1] - social[0]).mean() > -3 * (social[1] - social[0]).std() / 90


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("collisions", ["instants", "swept"])
def test_the_value_is_near_the_simulated_cost(collisions):
    solution = feedback_optimum(following(collisions=collisions))
    cost = evaluate(solution.game, solution.players(), 8192, seed=1).cost.mean(axis=0)
    assert sum(solution.value) == pytest.approx(cost.sum(), rel=0.02)


def respond(game, rules=None, **limits):
    """The best response of the first agent to a player that sees it."""
    seeing = feedback_optimum(game, rules).players()
    return best_feedback_response(game, 0, seeing, rules, step=2.5, **limits)


def of_one(game, rules=None, **limits):
    """The policy of the first agent without the other."""
    return feedback_optimum(replace(game, agents=game.agents[:1]), rules, **limits)


@pytest.mark.parametrize("solve", [feedback_optimum, feedback_equilibrium, respond, of_one])
@pytest.mark.parametrize("on_goal", first(1, ["remove", "stay"]))
def test_threads_do_not_change_results(solve, on_goal):
    game, rules = following(), Rules(on_goal=on_goal, max_cycles=5)
    threads, results = numba.get_num_threads(), []
    try:
        for count in (1, min(2, threads)):
            numba.set_num_threads(count)
            solution = solve(game, rules)
            played = evaluate(solution.game, solution.players(), 64, rules=rules)
            results.append((solution.value, played.cost))
    finally:
        numba.set_num_threads(threads)
    assert results[0][0] == results[1][0]
    assert np.array_equal(results[0][1], results[1][1])


def test_threads_do_not_change_stages():
    game, rules = following(), Rules(max_cycles=5)
    threads, stages = numba.get_num_threads(), []
    try:
        for count in (1, min(2, threads)):
            numba.set_num_threads(count)
            stages.append(feedback_equilibrium(game, rules).policy.stages)
    finally:
        numba.set_num_threads(threads)
    assert np.array_equal(stages[0].fields, stages[1].fields)
    assert np.array_equal(stages[0].choice, stages[1].choice)


@pytest.mark.parametrize("solve", [feedback_optimum, feedback_equilibrium, respond, of_one])
def test_limits_end_with_words(solve):
    game = following()
    with pytest.raises(InputError, match=r"memory_limit.*GB are needed"):
        solve(game, memory_limit=1e3)
    with pytest.raises(InputError, match=r"time_limit.*1 of 20 stages"):
        solve(game, time_limit=0.0)


@pytest.mark.slow
def test_memory_is_announced_and_kept():
    """Arrays of all stages and those in use at the same time, as Python's allocator sees them."""
    game = line_game(line_agent(0.0, 400.0), line_agent(25.0, 425.0, -6.0, 6.0))
    feedback_optimum(following())  # loads and compiles
    tracemalloc.start()
    solution = feedback_optimum(game, Rules(max_cycles=3), step=0.5)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 0.3 * solution.memory < peak < 1.1 * solution.memory


def test_games_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="has 3 agents"):
        feedback_optimum(make_game("intersection3"))


@pytest.mark.parametrize("start", first(1, ["selfish", "social", "swapped"]))
def test_an_equilibrium_becomes_stationary(start):
    solution = feedback_equilibrium(following(horizon=15), start=start)
    assert solution.stationary
    assert solution.stages < 30
