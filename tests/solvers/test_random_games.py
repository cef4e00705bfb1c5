"""Random small games: no drawn plan is better than a best response."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings

from ppg_env import Agent, Game, Polytope, evaluate, make_plan
from solvers import (
    Status,
    best_response,
    best_response_dynamics,
    potential_equilibrium,
    social_optimum,
)
from tests.oracles.slow_evaluator import slow_evaluation
from tests.ppg_env.strategies import plays

HORIZON = 7


@settings(max_examples=15)
@given(plays(scale="exact"))
def test_a_best_response_beats_the_plan_that_was_drawn(play):
    game, profile = play.game, play.profile
    judged = evaluate(game, profile)
    for i in range(len(game.agents)):
        if judged.violations((i,)):
            continue
        cost = judged.shifted_cost[i]
        near = 1e-6 * max(1.0, cost)
        solution = best_response(game, i, profile)
        assert solution.status is Status.OPTIMAL
        assert solution.value <= cost + near
        assert solution.bound <= cost + near
        assert solution.evaluation.violations((i,)) == ()


@settings(max_examples=10)
@given(plays(scale="exact"))
def test_the_social_optimum_beats_the_profile_that_was_drawn(play):
    game, judged = play.game, evaluate(play.game, play.profile)
    assume(judged.feasible)
    solution = social_optimum(game)
    near = 1e-6 * max(1.0, judged.social_cost)
    assert solution.status is Status.OPTIMAL
    assert solution.value <= judged.social_cost + near
    assert solution.bound <= judged.social_cost + near
    found = slow_evaluation(game, [plan.controls for plan in solution.profile])
    assert solution.value == pytest.approx(sum(found.shifted_cost), rel=1e-6, abs=1e-6)


def random_game(seed):
    """Two or three polygons of random shape, noise and speed, meeting near the origin."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 4))
    agents = []
    for k in range(count):
        angle = 2 * np.pi * (k + 0.6 * random.random()) / count
        start = 25 * np.array([np.cos(angle), np.sin(angle)])
        root = random.normal(size=(2, 2))
        agents.append(
            Agent(
                start=start,
                goal=-start + random.normal(size=2) * 4,
                shape=_polygon(random, 4.0),
                control=_polygon(random, 26.0),
                lam=float(random.uniform(0.1, 0.9)),
                gain=float(random.uniform(0, 0.9)),
                noise=root @ root.T + 0.2 * np.eye(2),
            )
        )
    objective = "risk" if random.random() < 0.5 else "margin"
    return Game(tuple(agents), horizon=HORIZON, objective=objective), random


def _polygon(random, radius):
    """Four to six corners, near those of a regular polygon, around the origin."""
    corners = int(random.integers(4, 7))
    angles = 2 * np.pi * (np.arange(corners) + random.uniform(-0.2, 0.2, corners)) / corners
    sizes = radius * random.uniform(0.8, 1.2, corners)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    return Polytope.from_vertices(sizes[:, None] * circle)


def drawn_plan(agent, random):
    """A plan to the goal in a random time: the straight one bent as far as its controls allow."""
    steps = int(random.integers(1, HORIZON + 1))
    even = np.tile((agent.goal - agent.start) / steps, (steps, 1))
    bend = random.normal(size=(steps, 2))
    bend -= bend.mean(axis=0)
    room = agent.control.offsets - even @ agent.control.normals.T
    push = bend @ agent.control.normals.T
    if (room < 0).any():
        return None
    far = np.min(room[push > 1e-12] / push[push > 1e-12], initial=100.0)
    controls = np.zeros((HORIZON, 2))
    controls[:steps] = even + random.uniform(0, 1) * (far - 1e-9) * bend
    return make_plan(agent, controls)


@pytest.mark.parametrize("seed", range(12))
def test_none_of_many_drawn_plans_beats_a_best_response(seed):
    game, random = random_game(seed)
    profile = tuple(
        next(plan for _ in range(1000) if (plan := drawn_plan(agent, random)))
        for agent in game.agents
    )
    solution = best_response(game, 0, profile)
    assert solution.status is Status.OPTIMAL
    sound = 0
    for _ in range(400):
        plan = drawn_plan(game.agents[0], random)
        if plan is None:
            continue
        judged = evaluate(game, (plan, *profile[1:]))
        if not judged.violations((0,)):
            sound += 1
            assert solution.value <= judged.shifted_cost[0] + 1e-6
            assert solution.bound <= judged.shifted_cost[0] + 1e-6
    assert sound > 5


@pytest.mark.parametrize("seed", range(4))
def test_equilibria_and_optima_of_random_games_keep_their_promises(seed):
    game, _ = random_game(seed)
    social, potential = social_optimum(game), potential_equilibrium(game)
    nash = best_response_dynamics(game, start="sequential", seed=seed, order="random")
    assert social.status is Status.OPTIMAL
    assert potential.status is Status.OPTIMAL
    assert potential.regret.max() <= 1e-5
    assert nash.status in (Status.EQUILIBRIUM, Status.INFEASIBLE)
    for solution in (potential, nash):
        if solution.profile is not None:
            assert solution.regret.max() <= 1e-5
            assert solution.evaluation.potential >= potential.bound - 1e-6
            assert solution.evaluation.social_cost >= social.bound - 1e-6
