"""The environment is exactly the planners' game: returns, bounds, crash frequencies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ppg_env import Game, evaluate, make_game
from ppg_env.env import episodes as arena
from ppg_env.env.parallel_env import PathPlanningEnv
from ppg_env.env.players import GoToGoal, straight_players, track
from ppg_env.env.rules import Rules
from ppg_env.risk.monte_carlo import crash_counts
from solvers import best_response_dynamics
from tests.marks import first

PAPER = ["opposing", "head_on", "parallel", "intersection", "intersection3"]


@pytest.mark.parametrize("gain", first(1, [0.5, 0.0]))
@pytest.mark.parametrize("scenario", PAPER)
def test_a_plan_without_noise_returns_exactly_minus_its_shifted_cost(
    scenario: str, gain: float
) -> None:
    game = make_game(scenario, gain=gain, lam=0.8, margin_cap=10.0)
    solution = best_response_dynamics(game)
    assert solution.profile is not None
    schedule = tuple(plan.arrival for plan in solution.profile)
    env = PathPlanningEnv(game, arrival="schedule", schedule=schedule, reward="margin")
    env.reset(seed=0)
    env.simulator.tables.root[:] = 0.0  # no noise, but the covariances that the plan was made for
    returns = dict.fromkeys(env.agents, 0.0)
    while env.agents:
        t = int(env.simulator.clock[0])
        controls = {f"agent_{i}": plan.controls[t] for i, plan in enumerate(solution.profile)}
        for agent, reward in env.step({a: controls[a] for a in env.agents})[1].items():
            returns[agent] += reward
    judged = evaluate(game, solution.profile)
    if (scenario, gain) == ("head_on", 0.0):
        assert judged.deficit.sum() > 0, "a case where margins are given up"
    np.testing.assert_allclose(list(returns.values()), -judged.shifted_cost, atol=1e-6)


@pytest.mark.parametrize("on_crash", ["remove", "continue"])
@pytest.mark.parametrize("gain", first(1, [0.5, 0.0]))
def test_on_schedule_crashes_and_losses_are_those_of_the_plans(gain: float, on_crash: str) -> None:
    game = make_game("head_on", speed="l1", objective="risk", lam=0.8, gain=gain)
    solution = best_response_dynamics(game)
    assert solution.profile is not None
    schedule = tuple(plan.arrival for plan in solution.profile)
    rules = Rules(arrival="schedule", schedule=schedule, saturation="none", on_crash=on_crash)
    episodes = arena.evaluate(game, track(game, solution.profile), 40_000, 3, rules=rules)
    found = episodes.summary()
    plans = crash_counts(game, solution.profile, 200_000, seed=8).estimates()[1]
    assert found.crash_any.low <= plans.high
    assert plans.low <= found.crash_any.high
    for mean, bound in zip(found.cost, solution.evaluation.shifted_cost, strict=True):
        assert mean.low <= bound


def test_rewards_are_minus_the_costs_that_the_arena_counts() -> None:
    game = make_game("intersection", crash_cost=30.0)
    env = PathPlanningEnv(game)
    random = np.random.default_rng(0)
    for episode in range(20):
        env.reset(seed=episode)
        while env.agents:
            result = env.step({a: random.uniform(-10, 10, 2) for a in env.agents})
            for agent, reward in result[1].items():
                info = result[4][agent]
                assert reward == -(info["time_cost"] + info["safety_cost"])
                assert info["time_cost"] == 0.5
                assert info["safety_cost"] == (15.0 if info["crashed"] else 0.0)


def test_the_arena_is_deterministic_and_more_episodes_only_add_to_it() -> None:
    game = make_game("opposing", speed="l1")
    few = arena.evaluate(game, straight_players(game), 50, 7)
    many = arena.evaluate(game, straight_players(game), 5000, 7)
    assert np.array_equal(few.cost, many.cost[:50])
    assert np.array_equal(few.arrival, many.arrival[:50])
    assert not np.array_equal(few.cost, arena.evaluate(game, straight_players(game), 50, 8).cost)


def test_players_meet_the_same_noise() -> None:
    """The same player under two names has the same episodes, whatever was played in between."""
    game = make_game("head_on")
    first = arena.evaluate(game, straight_players(game), 200, 1)
    arena.evaluate(game, [GoToGoal(game, i) for i in range(2)], 200, 1)
    assert np.array_equal(first.cost, arena.evaluate(game, straight_players(game), 200, 1).cost)


def apart(**overrides: Any) -> Game:
    """Two agents that never meet."""
    lane = {"start": {1: [10.0, -500.0]}, "goal": {1: [95.0, -500.0]}}
    return make_game("parallel", **lane, **overrides)


def test_homing_reaches_the_goal_from_anywhere() -> None:
    game = apart(speed="l1", sigma0=100.0)
    players = [GoToGoal(game, i) for i in range(2)]
    found = arena.evaluate(game, players, 500, 2).summary()
    assert all(share.value > 0.99 for share in found.success)


def test_a_tracked_plan_homes_once_it_has_run_out() -> None:
    """Noise pushes many episodes past the plan's arrival; they end at the goal all the same."""
    game = apart(gain=0.0, noise=6.0)
    found = arena.evaluate(game, straight_players(game), 2000, 2).summary()
    assert all(share.low > 0.97 for share in found.success)
    assert all(mean.value > 9 for mean in found.arrival)
