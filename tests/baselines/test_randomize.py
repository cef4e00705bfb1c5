"""Training on episodes that are drawn: the bridge to stable-baselines3 under rules."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor

from baselines import GameVecEnv
from ppg_env import InputError, make_game
from ppg_env.env import Choice, Near, Randomize, Rules, Uniform

RULE = Randomize(start=Near(5.0), lam=Uniform(0.0, 0.1), agents=Choice([1, 2, 3]), shared=("lam",))


def test_slots_observe_and_pay_what_their_copy_has_drawn() -> None:
    game, rules = make_game("intersection3"), Rules(max_cycles=8)
    env = GameVecEnv(game, rules, 12, randomize=RULE, shaping=False, reward_scale=1.0, seed=1)
    seen, restarts = env.reset().reshape(12, 3, -1), 0
    for _ in range(30):
        lam, playing = seen[..., -1], env.simulator.variation.values.playing.copy()
        assert env.observation_space.shape == seen.shape[2:]
        assert np.array_equal(lam > 0, playing)
        moving = env.simulator.alive.copy()
        flat, rewards, done, infos = env.step(np.zeros((36, 2)))
        rewards, done = rewards.reshape(12, 3), done.reshape(12, 3)
        quiet = moving & ~env.simulator.last.crashed
        np.testing.assert_allclose(rewards[quiet], -lam[quiet], rtol=1e-5)
        assert not rewards[~playing].any()
        assert np.array_equal(done.all(axis=1), done.any(axis=1))
        for slot in np.flatnonzero(done):
            last = infos[slot]["terminal_observation"]
            assert last[-1] == pytest.approx(lam.ravel()[slot])
        restarts += int(done[:, 0].sum())
        seen = flat.reshape(12, 3, -1)
    assert restarts > 20


class Rising(BaseCallback):
    """Raises lam at every rollout."""

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        low = 0.2 * (self.num_timesteps // (self.model.n_steps * self.training_env.num_envs))
        self.training_env.set_attr("randomize", replace(RULE, lam=Uniform(low, low + 0.1)))


def test_a_callback_raises_lam_over_training() -> None:
    env = GameVecEnv(make_game("intersection3"), Rules(max_cycles=8), 8, randomize=RULE)
    model = PPO("MlpPolicy", VecMonitor(env), n_steps=16, batch_size=64, n_epochs=1, device="cpu")
    model.learn(4 * 16 * 24, callback=Rising())
    assert (env.simulator.lam >= 0.6).all(), "the episodes of the last rollout have its range"


def test_a_rule_must_fit_the_learners_and_the_weights() -> None:
    game = make_game("intersection3")
    with pytest.raises(InputError, match="weights: and randomize both draw lam"):
        GameVecEnv(game, randomize=RULE, weights=(0.1, 0.9))
    with pytest.raises(InputError, match="learner, agent 1, would not play"):
        GameVecEnv(game, randomize=RULE, learners=[1])
    env = GameVecEnv(game, randomize=Randomize(start=Near(1.0)), weights=(0.1, 0.9), copies=4)
    assert env.reset().shape == (12, env.simulator.observation_size + 1)
    with pytest.raises(InputError, match="randomize"):
        env.set_attr("randomize", RULE)


def test_options_of_all_slots_are_values_of_the_next_episodes() -> None:
    env = GameVecEnv(make_game("head_on"), Rules(max_cycles=2), 3, learners=[1], weights=(0.1, 0.5))
    env.set_options({"lam": 0.9, "start": [80.0, 60.0]})
    seen = env.reset()
    np.testing.assert_allclose(seen[:, -1], 0.9)
    assert env.simulator.state[:, 1].tolist() == [[80.0, 60.0]] * 3
    for _ in range(2):
        seen, _, done, infos = env.step(np.zeros((3, 2)))
    assert done.all()
    assert all(info["terminal_observation"][-1] == np.float32(0.9) for info in infos)
    assert (seen[:, -1] <= 0.5).all()
    assert env.simulator.state[:, 1].tolist() == [[90.0, 50.0]] * 3
    assert (env.reset()[:, -1] <= 0.5).all(), "options hold for one reset"
    env.set_options([{"lam": 0.1}, {"lam": 0.2}, {}])
    with pytest.raises(InputError, match="options: differ between slots"):
        env.reset()
