"""The vector environment against single ones, in each mode of resetting, through Gymnasium."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

from ppg_env import InputError, SingleAgentEnv
from ppg_env.env.players import GoToGoal
from ppg_env.env.vector_env import GameVectorEnv
from tests.marks import first

GAME = "intersection3"


def towards_goal(envs: GameVectorEnv) -> np.ndarray:
    """Actions with which the learner arrives."""
    player = GoToGoal(envs.game, envs.learner)
    return player.act(envs.simulator.view(envs.learner)).astype(np.float32)


@pytest.mark.parametrize("observation", first(2, ["relative", "lidar", "neighbours(k=1)", "state"]))
@pytest.mark.parametrize("learner", first(1, [0, 2]))
def test_one_copy_is_the_single_environment(observation: str, learner: int) -> None:
    options: dict[str, Any] = {"observation": observation, "learner": learner, "reward": "margin"}
    options |= {"sharing": "social" if learner else "selfish"}
    single = SingleAgentEnv(GAME, **options)
    envs = GameVectorEnv(GAME, 1, autoreset_mode="SameStep", **options)
    assert single.observation_space == envs.single_observation_space
    assert single.action_space == envs.single_action_space
    wanted, observed = single.reset(seed=8)[0], envs.reset(seed=8)[0]
    for _ in range(60):
        assert np.array_equal(wanted, observed[0])
        action = towards_goal(envs)
        wanted, reward, terminated, truncated, info = single.step(action[0])
        observed, rewards, terminations, truncations, infos = envs.step(action)
        assert (reward, terminated, truncated) == (rewards[0], terminations[0], truncations[0])
        if terminated or truncated:
            assert np.array_equal(infos["final_obs"][0], wanted)
            infos, wanted = infos["final_info"], single.reset()[0]
        for key in ("arrived", "crashed", "in_traffic", "time_cost", "safety_cost"):
            assert infos[key][0] == info[key], key


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_modes_of_resetting_are_declared_and_kept(mode: AutoresetMode) -> None:
    envs = GameVectorEnv(GAME, 50, autoreset_mode=mode, noise=30.0, max_cycles=12)
    assert envs.metadata["autoreset_mode"] is mode
    observations, infos = envs.reset(seed=0)
    first, ends, waiting = observations.copy(), 0, np.zeros(50, dtype=bool)
    assert infos["_arrived"].all()
    for _ in range(40):
        if mode is AutoresetMode.DISABLED and waiting.any():
            observations, infos = envs.reset(options={"reset_mask": waiting})
            assert np.array_equal(infos["_crashed"], waiting)
            assert np.array_equal(observations[waiting], first[waiting])
            waiting[:] = False
        action = towards_goal(envs)
        action[waiting] = np.nan  # ignored
        observations, rewards, terminations, truncations, infos = envs.step(action)
        ended = terminations | truncations
        ends += int(ended.sum())
        assert not (ended & waiting).any()
        assert not rewards[waiting].any()
        if mode is AutoresetMode.SAME_STEP:
            assert np.array_equal(observations[ended], first[ended])
            assert ("final_obs" in infos) == bool(ended.any())
            for c in np.flatnonzero(ended):
                assert not np.array_equal(infos["final_obs"][c], first[c])
        else:
            assert np.array_equal(observations[waiting], first[waiting])
            assert not (observations[ended] == first[ended]).all(axis=1).any()
            waiting = ended
    assert ends > 100


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_episodes_of_both_modes_have_the_lengths_of_single_ones(mode: str) -> None:
    envs = RecordEpisodeStatistics(GameVectorEnv(GAME, 4, noise=0.0, autoreset_mode=mode))
    single = SingleAgentEnv(GAME, noise=0.0)
    single.reset(seed=0)
    total, length, over = 0.0, 0, False
    player = GoToGoal(single.game, 0)
    while not over:
        action = player.act(single._env.simulator.view(0))[0]
        _, reward, terminated, truncated, _ = single.step(action)
        total, length, over = total + reward, length + 1, terminated or truncated
    envs.reset(seed=0)
    returns: list[float] = []
    for _ in range(3 * length):
        infos = envs.step(towards_goal(envs.unwrapped))[4]
        if "episode" in infos:
            returns += infos["episode"]["r"].tolist()
            assert set(infos["episode"]["l"]) == {length}
    assert len(returns) >= 8
    np.testing.assert_allclose(returns, total, rtol=1e-5)


def test_gymnasium_makes_and_wraps_it() -> None:
    envs = gymnasium.make_vec("ppg/Circle-v0", num_envs=8, n=4, observation="box")
    assert isinstance(envs.unwrapped, GameVectorEnv)
    assert envs.observation_space.shape == (8, *envs.single_observation_space.shape)
    envs.reset(seed=1)
    wrapped = NormalizeObservation(envs)
    wrapped.reset(seed=1)
    for _ in range(50):
        observations = wrapped.step(wrapped.action_space.sample())[0]
    assert np.isfinite(observations).all()


def test_a_seed_fixes_all_copies_and_arrays_are_the_caller_s() -> None:
    trails = []
    for seed in (3, 3, 4, [1, 2], [1, 2]):
        envs = GameVectorEnv("head_on", 2)
        kept = [envs.reset(seed=seed)[0]]
        kept += [envs.step(np.ones((2, 2)))[0] for _ in range(3)]
        trails.append(np.array(kept))
    assert np.array_equal(trails[0], trails[1])
    assert np.array_equal(trails[3], trails[4])
    assert not np.array_equal(trails[0], trails[2])
    assert not np.array_equal(trails[0][1], trails[0][2]), "no array is overwritten"
    assert not np.array_equal(trails[0][3][0], trails[0][3][1]), "copies differ"


@pytest.mark.parametrize(
    ("action", "words"),
    [(np.ones(2), "shape"), (np.ones((3, 2)), "shape"), (np.full((2, 2), np.nan), "finite")],
)
def test_wrong_actions_are_refused(action: np.ndarray, words: str) -> None:
    envs = GameVectorEnv("head_on", 2)
    with pytest.raises(InputError, match="call reset first"):
        envs.step(np.ones((2, 2)))
    envs.reset(seed=0)
    before = envs.simulator.bodies.copy()
    with pytest.raises(InputError, match=words):
        envs.step(action)
    assert np.array_equal(envs.simulator.bodies, before)


def test_wrong_options_are_refused() -> None:
    with pytest.raises(InputError, match="autoreset_mode"):
        GameVectorEnv("head_on", autoreset_mode="never")
    with pytest.raises(InputError, match="reset_mask"):
        GameVectorEnv("head_on", 2).reset(options={"reset_mask": np.ones(3, dtype=bool)})
    with pytest.raises(InputError, match="copies"):
        GameVectorEnv("head_on", 0)
    for mode in ("SameStep", "NextStep", "Disabled"):
        with pytest.raises(InputError, match="call reset first"):
            GameVectorEnv("head_on", autoreset_mode=mode).step(np.ones((1, 2)))
