"""PettingZoo's and Gymnasium's own tests, over the whole registry and the life-cycles."""

from __future__ import annotations

import copy
import pickle
import warnings
from typing import Any

import numpy as np
import pettingzoo
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import (
    api_test,
    max_cycles_test,
    parallel_api_test,
    parallel_seed_test,
    render_test,
    seed_test,
)
from pettingzoo.test.state_test import state_test

import ppg_env
from ppg_env import InputError, Polytope, SingleAgentEnv, make_game, path_planning_v0
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.obstacle import Obstacle
from tests.marks import first
from tests.ppg_env.env.conftest import LIFE_CYCLES, name, needs_registry, with_schedule

# PettingZoo's tests advise against unbounded observations and read attributes through wrappers.
pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")


@pytest.fixture(params=LIFE_CYCLES, ids=name)
def options(request: pytest.FixtureRequest) -> dict[str, Any]:
    return request.param


def made(scenario: str, options: dict[str, Any], **more: Any) -> ppg_env.PathPlanningEnv:
    game = make_game(scenario)
    return path_planning_v0.parallel_env(game, **with_schedule(options, len(game.agents)), **more)


def test_every_life_cycle_passes_the_parallel_api_test(options: dict[str, Any]) -> None:
    parallel_api_test(made("intersection3", options), num_cycles=100)


@pytest.mark.parametrize("reward", first(1, ["risk", "margin"]))
def test_every_scenario_passes_the_parallel_api_test(scenario: str, reward: str) -> None:
    parallel_api_test(made(scenario, {"reward": reward}), num_cycles=100)


def test_every_scenario_passes_the_turn_based_api_test(scenario: str) -> None:
    api_test(path_planning_v0.env(scenario), num_cycles=60)


def test_every_life_cycle_passes_the_turn_based_api_test(options: dict[str, Any]) -> None:
    env = path_planning_v0.env("intersection", **with_schedule(options, 2))
    api_test(env, num_cycles=60)


def test_every_scenario_passes_the_seed_tests(scenario: str) -> None:
    parallel_seed_test(lambda: path_planning_v0.parallel_env(scenario))
    seed_test(lambda: path_planning_v0.env(scenario), num_cycles=30)


def test_max_cycles_are_kept() -> None:
    max_cycles_test(path_planning_v0)


def test_rendering_passes_the_render_test(scenario: str) -> None:
    render_test(lambda render_mode: path_planning_v0.env(scenario, render_mode=render_mode)
                if render_mode != "human" else path_planning_v0.env(scenario))  # fmt: skip


def test_state_passes_the_state_test(scenario: str) -> None:
    parallel = path_planning_v0.parallel_env(scenario)
    state_test(path_planning_v0.env(scenario), parallel)


def test_the_gymnasium_view_passes_gymnasium_s_checker(scenario: str) -> None:
    check_env(SingleAgentEnv(scenario), skip_render_check=True)


@pytest.mark.parametrize("reward", ["risk", "margin"])
@pytest.mark.parametrize("sharing", ["selfish", "social"])
def test_games_in_motion_pass_the_tests(reward: str, sharing: str) -> None:
    game, rules = in_motion(), {"reward": reward, "sharing": sharing}
    parallel_api_test(path_planning_v0.parallel_env(game, **rules), num_cycles=100)
    api_test(path_planning_v0.env(game, **rules), num_cycles=60)
    parallel_seed_test(lambda: path_planning_v0.parallel_env(game, **rules))
    state_test(path_planning_v0.env(game), path_planning_v0.parallel_env(game))
    check_env(SingleAgentEnv(game, **rules), skip_render_check=True)


def crowded() -> ppg_env.Game:
    """Bodies that start a step apart and soon crash."""
    return make_game("circle(3)", start={0: [0, 0], 1: [17, 0], 2: [0, 17]}, noise=9.0)


def early() -> ppg_env.Game:
    """One agent starts at its goal, and one arrives in its first step."""
    starts = {0: [95.0, 50.0], 1: [11.0, 50.0]}
    return make_game("head_on", start=starts, goal={0: [95.0, 50.0], 1: [5.0, 50.0]})


@pytest.mark.parametrize("on_goal", first(1, ["remove", "stay"]))
@pytest.mark.parametrize("on_crash", ["remove", "continue"])
@pytest.mark.parametrize("make", [crowded, early])
def test_crashes_and_early_arrivals_pass_the_tests(make: Any, on_crash: str, on_goal: str) -> None:
    game, rules = make(), {"on_crash": on_crash, "on_goal": on_goal}
    parallel_api_test(path_planning_v0.parallel_env(game, **rules), num_cycles=100)
    api_test(path_planning_v0.env(game, **rules), num_cycles=60)
    parallel_seed_test(lambda: path_planning_v0.parallel_env(game, **rules))
    for learner in range(len(game.agents)):
        check_env(SingleAgentEnv(game, learner, **rules), skip_render_check=True)
    events = []
    for seed in range(5):
        trail = play(path_planning_v0.parallel_env(game, **rules), seed)
        infos = [trail[0][1], *(step[4] for step in trail[1:])]
        key = "crashed" if make is crowded else "arrived"
        events += [info[key] for step in infos[:3] for info in step.values()]
    assert any(events)


def in_motion() -> ppg_env.Game:
    """Swept collisions, bodies that stay, workspaces, and obstacles that drift and go away."""
    shuttle = Obstacle(Polytope.box([6, 6]), [[50.0, 90.0 - 8 * t] for t in range(8)], noise=0.5)
    leaving = Obstacle(Polytope.box([9, 9]), [[30.0, 20.0], [40.0, 30.0]], until=3)
    room = HalfSpaces.between([0.0, 0.0], [100.0, 100.0])
    return make_game(
        "head_on", collisions="swept", on_goal="stay", within=room, obstacles=(shuttle, leaving)
    )


def test_observations_and_state_hold_the_moving_obstacles() -> None:
    env = path_planning_v0.parallel_env(in_motion(), noise=0.0)
    env.simulator.tables.root[:] = 0.0
    observations, _ = env.reset(seed=0)
    scale, centre = env.simulator.tables.scale, env.simulator.tables.centre
    for t in range(4):
        place, last = np.array([50.0, 90.0 - 8 * t]), np.array([30.0 + 10 * min(t, 1), 20.0])
        last[1] += 10 * min(t, 1)
        for i, agent in enumerate(env.agents):
            own = env.simulator.state[0, i]
            shuttle, leaving = observations[agent][-10:].reshape(2, 5)
            wanted = [1.0, *(place - own) / scale, 0.0, -8.0 / scale]
            np.testing.assert_allclose(shuttle, wanted, atol=1e-6)
            move = 10.0 / scale if t == 0 else 0.0
            there = [1.0, *(last - own) / scale, move, move] if t < 3 else [0.0] * 5
            np.testing.assert_allclose(leaving, there, atol=1e-6)
        relative = np.concatenate([place, last]) - np.tile(centre, 2)
        np.testing.assert_allclose(env.state()[-4:], relative / scale, atol=1e-6)
        observations = env.step({agent: np.ones(2) for agent in env.agents})[0]


def test_infos_say_who_is_outside_the_workspace() -> None:
    env = path_planning_v0.parallel_env(in_motion(), noise=0.0, saturation="none")
    _, infos = env.reset(seed=0)
    assert [info["outside"] for info in infos.values()] == [False, False]
    left = -1.0 - env.simulator.state[0, 0, 0]
    infos = env.step({"agent_0": np.array([left, 0.0]), "agent_1": np.zeros(2)})[4]
    assert [info["outside"] for info in infos.values()] == [True, False]


@needs_registry
def test_every_scenario_is_registered(scenario: str) -> None:
    plain = scenario.split("(")[0]
    env = pettingzoo.make("parallel", f"ppg/{plain}-v0", max_cycles=7)
    assert env.max_cycles == 7
    assert env.game == make_game(plain)


def play(env: ppg_env.PathPlanningEnv, seed: int, steps: int = 60) -> list[Any]:
    """A whole episode under random actions, everything that came out of it."""
    random = np.random.default_rng(seed)
    trail: list[Any] = [env.reset(seed=seed)]
    while env.agents and len(trail) < steps:
        actions = {agent: random.uniform(-10, 10, 2) for agent in env.agents}
        trail.append((*env.step(actions), env.state()))
    return trail


def same(one: Any, other: Any) -> bool:
    """Equality through dicts, tuples and arrays, types included."""
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[k], other[k]) for k in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)
    return bool(one == other)


def test_a_seed_fixes_the_whole_episode(options: dict[str, Any]) -> None:
    trails = [play(made("intersection3", options), seed=5) for _ in range(2)]
    assert same(*trails)
    assert not same(trails[0], play(made("intersection3", options), seed=6))


def test_a_seed_fixes_later_episodes_and_random_starts() -> None:
    game = make_game("head_on", sigma0=2.0)
    trails = []
    for _ in range(2):
        env = path_planning_v0.parallel_env(game)
        first = env.reset(seed=3)
        trails.append([first, *(env.reset() for _ in range(3))])
    assert same(*trails)
    starts = [trail[0]["agent_0"] for trail in trails[0]]
    assert not np.array_equal(starts[0], starts[1])


def test_environments_do_not_disturb_each_other() -> None:
    alone = play(made("intersection3", {}), seed=5)
    one, other = made("intersection3", {}), made("intersection3", {})
    random = np.random.default_rng(5)
    together: list[Any] = [one.reset(seed=5)]
    other.reset(seed=9)
    while one.agents:
        if other.agents:
            other.step({agent: np.ones(2) for agent in other.agents})
        np.random.seed(0)
        actions = {agent: random.uniform(-10, 10, 2) for agent in one.agents}
        together.append((*one.step(actions), one.state()))
    assert same(alone, together)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_made_mid_episode_goes_on_identically(duplicate: Any) -> None:
    env = made("intersection3", {"on_crash": "continue"})
    env.reset(seed=1)
    for _ in range(3):
        env.step({agent: np.full(2, 3.0) for agent in env.agents})
    twin = duplicate(env)
    for _ in range(10):
        actions = {agent: np.full(2, -1.0) for agent in env.agents}
        assert same(env.step(actions), twin.step(actions))
        assert np.array_equal(env.state(), twin.state())


def test_after_the_end_a_step_is_empty_whoever_still_sends_actions() -> None:
    env = made("head_on", {"max_cycles": 1})
    env.reset(seed=0)
    env.step({agent: np.zeros(2) for agent in env.agents})
    assert env.agents == []
    assert env.step({}) == ({}, {}, {}, {}, {})
    assert env.step({"agent_0": np.zeros(2)}) == ({}, {}, {}, {}, {})
    with pytest.raises(InputError, match="no agent"):
        env.step({"stranger": np.zeros(2)})


@pytest.mark.parametrize(
    ("action", "words"),
    [
        ({"agent_0": [np.nan, 0.0]}, "finite"),
        ({"agent_0": [np.inf, 0.0]}, "finite"),
        ({"agent_0": [0.0]}, "shape"),
        ({"agent_0": [[0.0, 0.0]]}, "shape"),
        ({"agent_0": "left"}, "finite"),
        ({"agent_0": None}, "finite"),
        ({"stranger": [0.0, 0.0]}, "no agent"),
    ],
)
def test_wrong_actions_are_answered_by_name(action: dict[str, Any], words: str) -> None:
    env = made("head_on", {})
    env.reset(seed=0)
    before = env.state()
    with pytest.raises(InputError, match=words):
        env.step({"agent_0": [0.0, 0.0], "agent_1": [0.0, 0.0]} | action)
    assert np.array_equal(env.state(), before), "a refused step must not move any agent"


def test_a_missing_action_is_answered_by_name() -> None:
    env = made("head_on", {})
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"actions\['agent_1'\]: is missing"):
        env.step({"agent_0": np.zeros(2)})


def test_values_have_the_promised_types() -> None:
    env = made("head_on", {})
    observations, _ = env.reset(seed=0)
    result = env.step({agent: np.zeros(2) for agent in env.agents})
    for agent, observation in (observations | result[0]).items():
        assert observation.dtype == np.float32
        assert env.observation_space(agent).contains(observation)
    assert all(type(value) is float for value in result[1].values())
    assert all(type(value) is bool for flags in result[2:4] for value in flags.values())
    assert all(type(info["crashed"]) is bool for info in result[4].values())
    assert env.state().dtype == np.float32
    assert env.state_space.contains(env.state())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"arrival": "never"}, "region or schedule"),
        ({"arrival": "schedule"}, "schedule: is missing"),
        ({"schedule": (1, 2)}, "arrival is 'region'"),
        ({"arrival": "schedule", "schedule": (1, 2, 3)}, "3 times for 2 agents"),
        ({"max_cycles": 0}, "max_cycles"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"bogus": 1}, "bogus"),
        ({"render_mode": "ascii"}, "rgb_array or human"),
    ],
)
def test_wrong_options_are_answered_by_name(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        path_planning_v0.parallel_env("head_on", **options)


def test_rendering_without_a_mode_warns() -> None:
    env = made("head_on", {})
    env.reset(seed=0)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert env.render() is None
    assert any("render_mode" in str(warning.message) for warning in caught)
