"""Swept collisions: the segment of a step against the collision set, in games and alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numba import njit
from scipy.optimize import linprog

from ppg_env import Agent, Game, Polytope, make_game
from ppg_env.env.parallel_env import PathPlanningEnv
from ppg_env.env.rules import Rules
from ppg_env.env.status import ARRIVED
from ppg_env.game.compiled_margins import crossing, inside
from ppg_env.game.hulls import corners_of_points
from ppg_env.game.obstacle import Obstacle
from ppg_env.tolerances import LENGTH
from solvers import best_response_dynamics, social_optimum
from solvers.feedback.replanning.replanner import replanning
from tests.marks import first

AXES = {1: (0,), 2: (0, 0), 3: (0, 0, 0)}


@njit
def crosses(axes: Any, before: Any, after: Any, normals: Any, depths: Any) -> bool:
    return crossing(axes, before, after, 0, 0, -1, normals, depths, 0, len(depths))


@njit
def contains(axes: Any, point: Any, normals: Any, depths: Any) -> bool:
    return inside(axes, point, 0, 0, -1, normals, depths, 0, len(depths))


def hit(shape: Polytope, start: Any, end: Any) -> bool:
    ends = [np.array(point, dtype=float).reshape(1, 1, -1) for point in (start, end)]
    return crosses(AXES[shape.dim], *ends, shape.normals, shape.offsets - LENGTH)


def deepest(shape: Polytope, start: np.ndarray, end: np.ndarray) -> float:
    """Largest depth of a point of the segment, by a linear program over its place and depth."""
    rows = np.column_stack([shape.normals @ (end - start), np.ones(len(shape.offsets))])
    room = shape.offsets - shape.normals @ start
    answer = linprog([0.0, -1.0], A_ub=rows, b_ub=room, bounds=[(0, 1), (None, None)])
    return float(answer.x[1])


def random_case(random: np.random.Generator) -> tuple[Polytope, np.ndarray, np.ndarray]:
    dim = int(random.integers(1, 4))
    if dim == 1:
        shape = Polytope.box([random.uniform(1, 4)])
    else:
        points = random.normal(0, 2, (int(random.integers(6, 16)), dim))
        shape = Polytope.from_vertices(corners_of_points(points))
    return shape, *random.normal(0, 3, (2, dim))


def test_the_swept_test_is_that_of_a_linear_program() -> None:
    random, hits = np.random.default_rng(1), 0
    for _ in range(300):
        shape, start, end = random_case(random)
        depth = deepest(shape, start, end)
        if abs(depth - LENGTH) > 1e-9:
            assert hit(shape, start, end) == (depth > LENGTH)
            hits += depth > LENGTH
    assert 80 < hits < 220


def test_the_swept_test_is_the_limit_of_ever_finer_substeps() -> None:
    random, late = np.random.default_rng(2), 0
    for _ in range(200):
        shape, start, end = random_case(random)
        found = []
        for pieces in (1, 16, 256, 4096):
            places = np.linspace(0, 1, pieces + 1)[:, None]
            points = (start + places * (end - start))[:, None, None]
            depths = shape.offsets - LENGTH
            found.append(any(contains(AXES[shape.dim], p, shape.normals, depths) for p in points))
        assert found == sorted(found), "finer steps only find more"
        late += found[-1] and not found[0]
        swept = hit(shape, start, end)
        assert found[-1] == swept or (swept and deepest(shape, start, end) < 0.02)
    assert late > 20


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_touching_is_no_crash(dim: int) -> None:
    box = Polytope.box([2.0] * dim)
    along = np.array([1.0, *[5.0] * (dim - 1)])  # along a face
    assert not hit(box, along * 1.0, along * np.array([1.0, *[-1.0] * (dim - 1)]))
    assert not hit(box, [1.0] * dim, [3.0] * dim), "away from a corner"
    assert hit(box, [-3.0] * dim, [3.0] * dim)
    if dim == 1:
        return
    rest = [0.0] * (dim - 2)
    assert not hit(box, [0.0, 2.0, *rest], [2.0, 0.0, *rest]), "past a corner"
    assert not hit(box, [0.0, 2.0 - LENGTH, *rest], [2.0 - LENGTH, 0.0, *rest])
    assert hit(box, [0.0, 2.0 - 4 * LENGTH, *rest], [2.0 - 4 * LENGTH, 0.0, *rest])
    slid = np.array([1.0 - 2 * LENGTH, 5.0, *rest])
    assert hit(box, slid, slid * [1.0, -1.0, *[1.0] * (dim - 2)]), "deeper than a touch"


def swap(**options: Any) -> PathPlanningEnv:
    """Two agents that swap places in one step."""
    body, speed = Polytope.box([4, 4]), Polytope.box([80, 80])
    ends = np.array([[0.0, 0.0], [20.0, 0.0]])
    agents = tuple(Agent(a, b, body, speed, noise=0.0) for a, b in (ends, ends[::-1]))
    rules = {key: options.pop(key) for key in ("on_crash", "arrival", "schedule") if key in options}
    return PathPlanningEnv(Game(agents, horizon=4, **options), tolerance=0.5, **rules)


def test_a_crash_in_the_step_of_arrival_counts_and_is_no_arrival() -> None:
    moves = {"agent_0": np.array([20.0, 0.0]), "agent_1": np.array([-20.0, 0.0])}
    for options, crashed, arrived in [
        ({}, False, True),
        ({"collisions": "swept"}, True, False),
        ({"collisions": "swept", "on_crash": "continue"}, True, True),
    ]:
        env = swap(**options)
        env.reset(seed=0)
        infos = env.step(moves)[4]
        assert {info["crashed"] for info in infos.values()} == {crashed}
        assert {info["arrived"] for info in infos.values()} == {arrived}


def test_the_game_says_whether_bodies_stay_and_the_rules_may_say_otherwise() -> None:
    ends = {"start": {0: [0.0, 0.0], 1: [60.0, 0.0]}, "goal": {0: [20.0, 0.0], 1: [60.0, 90.0]}}
    game = make_game("parallel", on_goal="stay", **ends)
    assert PathPlanningEnv(game).rules.on_goal == "stay"
    assert PathPlanningEnv(game, on_goal="remove").rules.on_goal == "remove"
    assert PathPlanningEnv("parallel").rules.on_goal == "remove"


@pytest.mark.parametrize("on_goal", ["remove", "stay"])
@pytest.mark.parametrize("scenario", first(2, ["head_on", "intersection", "corridor"]))
@pytest.mark.parametrize("plan", [social_optimum, best_response_dynamics])
def test_plans_never_crash_and_return_minus_their_shifted_cost(
    plan: Any, scenario: str, on_goal: str
) -> None:
    game = make_game(scenario, collisions="swept", on_goal=on_goal, lam=0.8, gain=0.0)
    game = replace(game, agents=tuple(replace(agent, effort=0.01) for agent in game.agents))
    check_plan(game, plan(game))


def test_plans_pass_moving_obstacles() -> None:
    game = make_game("head_on", collisions="swept", on_goal="stay", lam=0.8, speed="l1")
    shuttle = Obstacle(Polytope.box([6, 6]), [[50.0, 100.0 - 10 * t] for t in range(11)], noise=0.3)
    passing = Obstacle(Polytope.box([9, 9]), [[30.0, 20.0], [40.0, 30.0]], until=3)
    game = replace(game, obstacles=(shuttle, passing))
    check_plan(game, best_response_dynamics(game))


def check_plan(game: Game, solution: Any) -> None:
    schedule = tuple(plan.arrival for plan in solution.profile)
    env = PathPlanningEnv(game, arrival="schedule", schedule=schedule, reward="margin",
                          saturation="none")  # fmt: skip
    env.reset(seed=0)
    env.simulator.tables.root[:] = 0.0  # no noise, but the covariances that the plan was made for
    returns = dict.fromkeys(env.agents, 0.0)
    while env.agents:
        t = min(int(env.simulator.clock[0]), game.horizon - 1)
        controls = {f"agent_{i}": plan.controls[t] for i, plan in enumerate(solution.profile)}
        _, rewards, _, _, infos = env.step({a: controls[a] for a in env.agents})
        assert not any(info["crashed"] for info in infos.values())
        for agent, reward in rewards.items():
            returns[agent] += reward
    expected = -solution.evaluation.shifted_cost
    np.testing.assert_allclose(list(returns.values()), expected, atol=1e-5)


@pytest.mark.parametrize("social", [False, True])
def test_replanning_counts_from_now_and_around_what_is_parked(*, social: bool) -> None:
    """Nothing is in the way of agent 2 but a parked body and an obstacle that comes and goes."""
    body, speed, gate = Polytope.box([6, 6]), Polytope.box([20, 20]), Polytope.box([6, 30])

    def agent(start: list[float], goal: list[float]) -> Agent:
        return Agent(start, goal, body, speed, noise=0.0, lam=0.8)

    agents = (agent([40, 8], [40, 0]), agent([40, -8], [40, -7]), agent([0, 0], [90, 0]))
    closed = Obstacle(gate, [[25.0, 0.0]], until=4)
    sweeper = Obstacle(body, [[60.0, 80.0 - 8.0 * t] for t in range(13)], noise=0.2)
    game = Game(agents, (closed, sweeper), horizon=16, collisions="swept", on_goal="stay")
    profile = best_response_dynamics(game).profile
    rules = Rules(tolerance=0.5)
    players = replanning(game, profile, social=social, rules=rules)
    env = PathPlanningEnv(game, tolerance=0.5)
    env.reset(seed=0)
    env.simulator.tables.root[:] = 0.0
    while env.agents:
        actions = {
            a: players[int(a[-1])].act(env.simulator.view(int(a[-1])))[0] for a in env.agents
        }
        infos = env.step(actions)[4]
        assert not any(info["crashed"] for info in infos.values())
    assert env.simulator.status[0].tolist() == [ARRIVED] * 3
    assert (env.simulator.parked[0] <= [plan.arrival for plan in profile]).all()
