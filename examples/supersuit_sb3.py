"""PPO of stable-baselines3 with one policy for all agents, through SuperSuit's vector environment.

This is PettingZoo's tutorial with this game in it: python examples/supersuit_sb3.py.
``baselines.GameVecEnv`` does the same in one compiled batch, many times as fast.
"""

from __future__ import annotations

import numpy as np
import supersuit
import torch
from figures import report
from stable_baselines3 import PPO
from task import cpu_seconds, read_task

from baselines import ShapedEnv

if __name__ == "__main__":
    torch.manual_seed(1)
    torch.set_num_threads(1)  # the networks are small
    task = read_task(steps=50_000)  # of the environment; each moves all agents
    # SuperSuit's own way is black_death_v3, which observes zeros for agents that have left.  With
    # together=True they observe that they are out of traffic.
    env = ShapedEnv(task.game, together=True, **task.rules)
    env.reset(seed=1)
    env = supersuit.pettingzoo_env_to_vec_env_v1(env)
    env = supersuit.concat_vec_envs_v1(env, 8, num_cpus=1, base_class="stable_baselines3")
    model = PPO(
        "MlpPolicy",
        env,
        learning_rate=1e-3,
        n_steps=64,
        batch_size=256,
        gamma=0.99,
        policy_kwargs={"log_std_init": -0.5},
        device="cpu",
    )
    start = cpu_seconds()
    # stable-baselines3 counts the steps of each slot.
    model.learn(task.steps * len(task.game.agents))
    seconds = cpu_seconds() - start

    def act(_: int, observations: np.ndarray) -> np.ndarray:
        """Return the mean action."""
        return model.predict(observations, deterministic=True)[0]

    report("supersuit-sb3", task, act, steps=model.num_timesteps, seconds=seconds)
