"""Values of one episode, given to ``reset`` in every view, against games that have those values."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ppg_env import (
    GameVectorEnv,
    HalfSpaces,
    InputError,
    Obstacle,
    Polytope,
    Simulator,
    SingleAgentEnv,
    make_game,
    parallel_env,
    path_planning_v0,
)
from ppg_env.env.rules import Rules

NAMES = ("agent_0", "agent_1")
OTHER: dict[str, Any] = {
    "start": {0: [20.0, 48.0], 1: [80.0, 55.0]},
    "goal": {0: [90.0, 60.0]},
    "lam": [0.2, 0.7],
    "noise": {1: [[2.0, 0.5], [0.5, 1.0]]},
}


def walled() -> Any:
    wall = Obstacle(Polytope.from_vertices([[40, 0], [50, 0], [50, 20], [40, 20]]))
    return make_game("head_on", obstacles=(wall,))


def play(env: Any, steps: int = 12) -> list[Any]:
    """Positions and rewards under fixed actions."""
    trail = [env.simulator.state[0].copy()]
    for t in range(steps):
        if not env.agents:
            break
        rewards = env.step({a: 9.0 * np.array([np.cos(t), np.sin(t)]) for a in env.agents})[1]
        trail.append((env.simulator.state[0].copy(), rewards))
    return trail


def equal(one: list[Any], other: list[Any]) -> bool:
    pairs = zip(one[1:], other[1:], strict=True)
    return np.array_equal(one[0], other[0]) and all(
        np.array_equal(a[0], b[0]) and a[1] == b[1] for a, b in pairs
    )


@pytest.mark.parametrize("key", [*OTHER, "all"])
def test_an_episode_with_options_is_that_of_the_game_with_those_values(key: str) -> None:
    values = OTHER if key == "all" else {key: OTHER[key]}
    env, usual = parallel_env("head_on"), parallel_env("head_on")
    other = parallel_env("head_on", **values)
    env.reset(seed=3, options=values)
    other.reset(seed=3)
    assert env.simulator.game_of() == other.game
    assert equal(play(env), play(other))
    env.reset(seed=4)  # the values were those of one episode
    usual.reset(seed=4)
    assert env.simulator.game_of() == usual.game
    assert equal(play(env), play(usual))


def test_sizes_of_bodies_and_numbers_of_agents_are_those_of_the_game_so_made() -> None:
    env = parallel_env("circle(4)", on_crash="continue")
    agents = [
        replace(agent, shape=Polytope.box(agent.shape.params[0] * 1.5))
        for agent in env.game.agents[:3]
    ]
    game = replace(env.game, agents=tuple(agents))
    other = parallel_env(game, on_crash="continue")
    observations, infos = env.reset(seed=1, options={"size": 1.5, "agents": 3})
    other.reset(seed=1)
    assert env.agents == list(observations) == list(infos) == other.agents
    assert env.simulator.game_of() == game
    noise = np.random.default_rng(0).standard_normal((30, 1, 4, 2))
    action = np.zeros((4, 2))
    crashes = 0
    for k in range(30):
        action[:] = np.where(k % 2, 12.0, -5.0) - env.simulator.state[0]
        mine = env.simulator.step(action, noise[k], restart=False)
        theirs = other.simulator.step(action[:3], noise[k, :, :3], restart=False)
        assert np.array_equal(mine.reward[:, :3], theirs.reward)
        assert np.array_equal(mine.crashed[:, :3], theirs.crashed)
        assert np.array_equal(env.simulator.state[:, :3], other.simulator.state)
        assert not mine.reward[:, 3].any()
        crashes += int(mine.crashed.sum())
    assert crashes > 0


def test_observations_keep_the_frame_of_the_game() -> None:
    env = parallel_env("head_on")
    usual = env.reset(seed=0)[0]["agent_0"]
    moved = env.reset(seed=0, options={"start": {0: [20.0, 50.0]}})[0]["agent_0"]
    scale = env.simulator.tables.scale
    np.testing.assert_allclose((moved - usual)[[0, 2]], 10.0 / scale, rtol=1e-5)
    assert moved.shape == usual.shape


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"start": [[0, 0], [1, 1]]}, r"options.agent\[0\].start: overlaps agent\[1\].start"),
        ({"start": {0: [45.0, 10.0]}}, r"options.agent\[0\].start: overlaps obstacle\[0\]"),
        ({"goal": {1: [45.0, 10.0]}}, r"options.agent\[1\].goal: lies .* inside obstacle\[0\]"),
        ({"start": {0: [92.0, 80.0]}, "goal": {0: [90.0, 80.0]}}, "arrival region"),
        ({"start": {0: [1.0]}}, r"agent\[0\].start: is of shape \(1,\)"),
        ({"start": [[1.0, 2.0]] * 3}, "start: has 3 entries for 2 agents"),
        ({"goal": {1: [np.nan, 0.0]}}, r"agent\[1\].goal: has an entry that is not a finite"),
        ({"goal": "left"}, "goal: is not made of numbers"),
        ({"start": {"bob": [1.0, 1.0]}}, "start: names agent 'bob' of 2"),
        ({"lam": {"agent_1": 0.1, 1: 0.2}}, "lam: names agent 1 twice"),
        ({"start": {0: [1e20, 0.0]}}, "too large"),
        ({"lam": 1.0}, r"agent\[0\].lam: is 1"),
        ({"lam": [0.1, 0.2, 0.3]}, "lam: has 3 entries for 2 agents"),
        ({"lam": np.nan}, "not a finite number"),
        ({"noise": -1.0}, "not a covariance"),
        ({"noise": [[1.0, 2.0], [0.0, 1.0]]}, "not symmetric"),
        ({"noise": np.eye(3)}, "3x3 where 2x2"),
        ({"size": 0.0}, r"agent\[0\].size: is 0"),
        ({"size": 8.0}, "overlaps"),
        ({"agents": 3}, "agents: is 3; write how many play, a whole number from 1 to 2"),
        ({"agents": True}, "agents: is True"),
        ({"lamb": 0.3}, "options.lamb: is an unknown key of reset; perhaps you mean 'lam'"),
        ([1], "options: are"),
    ],
    ids=str,
)
def test_wrong_values_are_refused_in_a_sentence_and_nothing_changes(
    options: Any, sentence: str
) -> None:
    env = parallel_env(walled())
    env.reset(seed=0, options={"start": {0: [20.0, 50.0]}, "lam": 0.3})
    env.step({agent: np.ones(2) for agent in env.agents})
    twin = copy.deepcopy(env)
    with pytest.raises(InputError, match=sentence) as caught:
        env.reset(options=options)
    assert str(caught.value).count("\n") == 0
    assert equal(play(env), play(twin)), "a refused reset must not change the episode"
    assert not equal(play_after_reset(env), play(twin))


def play_after_reset(env: Any) -> list[Any]:
    env.reset(seed=5)
    assert env.simulator.game_of() == env.game
    return play(env)


def test_workspaces_and_parked_bodies_are_checked_too() -> None:
    room = HalfSpaces.between([0.0, 0.0], [100.0, 100.0])
    env = parallel_env(make_game("head_on", within=room, on_goal="stay", collisions="swept"))
    with pytest.raises(InputError, match="outside the workspace"):
        env.reset(options={"goal": {0: [120.0, 50.0]}})
    with pytest.raises(InputError, match=r"parks agent_1 on agent_0"):
        env.reset(options={"goal": {0: [50.0, 50.0], 1: [52.0, 50.0]}})


def test_the_official_tests_option_is_ignored_and_empty_options_change_nothing() -> None:
    env = parallel_env("head_on")
    for options in ({"options": 1}, {}, None, {"lam": None}):
        env.reset(seed=0, options=options)
        assert env.simulator.game_of() == env.game


@pytest.mark.parametrize("field", ["noise", "size"])
def test_margins_of_other_noise_or_bodies_are_refused(field: str) -> None:
    env = parallel_env("head_on", reward="margin")
    with pytest.raises(InputError, match=rf"options.{field}: cannot change .* reward = 'margin'"):
        env.reset(options={field: 1.1})
    env.reset(options={"lam": 0.2})
    assert env.simulator.lam.tolist() == [[0.2, 0.2]]


def test_turn_based_environments_take_them() -> None:
    env = path_planning_v0.env("circle(4)")
    env.reset(seed=0, options={"agents": 3, "lam": 0.9})
    assert env.agents == ["agent_0", "agent_1", "agent_2"]
    for agent in env.agent_iter(6):
        env.step(np.zeros(2, np.float32))
        assert env.rewards[agent] in (0, -0.9)
    env.reset(seed=0)
    assert len(env.agents) == 4


def test_a_single_point_is_the_learner_s() -> None:
    env = SingleAgentEnv("head_on", learner=1)
    env.reset(seed=0, options={"start": [80.0, 60.0], "goal": [20.0, 70.0], "lam": 0.1})
    simulator = env._env.simulator
    assert simulator.state[0].tolist() == [[10.0, 50.0], [80.0, 60.0]]
    assert simulator.game_of().agents[1].goal.tolist() == [20.0, 70.0]
    assert simulator.lam.tolist() == [[0.1, 0.1]]
    with pytest.raises(InputError, match="learner, agent 1, would not play"):
        env.reset(options={"agents": 1})


def test_the_others_head_for_the_goals_of_the_episode() -> None:
    env = SingleAgentEnv("head_on", learner=1, noise=0.0, max_cycles=60)
    options = {"start": {0: [30.0, 20.0]}, "goal": {0: [30.0, 95.0]}}
    env.reset(seed=0, options=options)
    over = False
    while not over:
        over = any(env.step(np.array([0.0, -3.0]))[2:4])
        if env._env.simulator.status[0, 0] == 1:
            break
    assert env._env.simulator.status[0, 0] == 1, "agent 0 has arrived"
    np.testing.assert_allclose(env._env.simulator.state[0, 0], [30.0, 95.0], atol=5.0)


@pytest.mark.parametrize("mode", ["SameStep", "NextStep", "Disabled"])
def test_vector_environments_give_values_to_the_copies_that_begin(mode: str) -> None:
    envs = GameVectorEnv("head_on", 4, autoreset_mode=mode, max_cycles=3, noise=0.0)
    envs.reset(seed=0, options={"lam": 0.9, "start": [20.0, 50.0]})
    assert envs.simulator.state[:, 0].tolist() == [[20.0, 50.0]] * 4
    mask = np.array([True, False, False, True])
    options = {"reset_mask": mask, "lam": 0.4, "start": [12.0, 30.0]}
    envs.reset(options=options)
    assert "reset_mask" in options, "the caller's dictionary is left alone"
    assert envs.simulator.lam[:, 0].tolist() == [0.4, 0.9, 0.9, 0.4]
    assert envs.simulator.state[:, 0, 0].tolist() == [12.0, 20.0, 20.0, 12.0]
    rewards = envs.step(np.zeros((4, 2)))[1]
    np.testing.assert_allclose(rewards, [-0.4, -0.9, -0.9, -0.4])
    for _ in range(2 if mode != "NextStep" else 3):
        envs.step(np.zeros((4, 2)))
    if mode == "Disabled":
        envs.reset(options={"reset_mask": np.ones(4, dtype=bool)})
    assert envs.simulator.clock.tolist() == [0] * 4
    assert (envs.simulator.lam == 0.5).all(), "automatic resets have the game's values"
    assert envs.simulator.state[:, 0].tolist() == [[10.0, 50.0]] * 4
    with pytest.raises(InputError, match=r"options\.speed"):
        envs.reset(options={"speed": 3})


def test_lam_that_was_assigned_comes_back_after_the_episode() -> None:
    simulator = Simulator(make_game("head_on"), Rules(), copies=2)
    simulator.lam = 0.25
    simulator.reset(options={"lam": 0.75})
    assert (simulator.lam == 0.75).all()
    simulator.reset()
    assert (simulator.lam == 0.25).all()


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_go_on_identically_over_resets_with_options(duplicate: Any) -> None:
    env = parallel_env("head_on")
    env.reset(seed=1, options=OTHER | {"size": 1.1})
    env.step({agent: np.ones(2) for agent in env.agents})
    twin = duplicate(env)
    assert equal(play(env), play(twin))
    for options in ({"start": {0: [15.0, 40.0]}, "size": 0.9}, None):
        env.reset(options=options)
        twin.reset(options=options)
        assert equal(play(env), play(twin))
        assert env.simulator.game_of() == twin.simulator.game_of()
