"""PPO with one policy for all agents, by RLlib's new API stack: python examples/rllib_ppo.py.

RLlib takes the PettingZoo parallel environment through ``ParallelPettingZooEnv``.
"""

from __future__ import annotations

import numpy as np
import ray
import torch
from figures import report
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env
from task import cpu_seconds, read_task

from baselines import ShapedEnv


class PathPlanning(ParallelPettingZooEnv):
    """RLlib's wrapper, with the end of an episode in which not all agents end alike.

    RLlib 2.60 sets ``__all__`` only where all agents of the last step terminate, or are truncated.
    """

    def step(self, action_dict: dict) -> tuple:
        """Move all living agents."""
        observations, rewards, terminated, truncated, infos = super().step(action_dict)
        if not self.par_env.agents:
            terminated["__all__"] = not any(truncated.values())
            truncated["__all__"] = not terminated["__all__"]
        return observations, rewards, terminated, truncated, infos


if __name__ == "__main__":
    torch.set_num_threads(1)  # the networks are small
    task = read_task(steps=50_000)  # of the environment; each moves all agents
    ray.init("local", num_cpus=1, include_dashboard=False)
    register_env("path_planning", lambda config: PathPlanning(ShapedEnv(task.game, **task.rules)))
    config = (
        PPOConfig()
        .environment("path_planning")
        .env_runners(num_env_runners=0)  # in this process; more on a larger machine
        .multi_agent(policies={"shared"}, policy_mapping_fn=lambda agent, *_, **__: "shared")
        .rl_module(
            model_config=DefaultModelConfig(
                fcnet_hiddens=[64, 64], fcnet_activation="tanh", vf_share_layers=False
            )
        )
        .training(
            lr=1e-3,
            gamma=0.99,
            lambda_=0.95,
            train_batch_size_per_learner=1024,
            minibatch_size=256,
            num_epochs=10,
            clip_param=0.2,
            vf_clip_param=10.0,
        )
        .debugging(seed=1, log_level="ERROR")
    )
    algo = config.build_algo()
    start, steps = cpu_seconds(), 0
    while steps < task.steps:
        result = algo.train()["env_runners"]  # returns are sums over agents, shaped and scaled
        steps = int(result["num_env_steps_sampled_lifetime"])
        mean, length = result["episode_return_mean"], result["episode_len_mean"]
        print(f"{steps} steps: mean return {mean:.2f}, length {length:.1f}", flush=True)
    seconds = cpu_seconds() - start

    module = algo.get_module("shared")

    def act(_: int, observations: np.ndarray) -> np.ndarray:
        """Return the mean action, the first half of what describes the distribution."""
        with torch.no_grad():
            out = module.forward_inference({"obs": torch.as_tensor(observations)})
        return np.split(out["action_dist_inputs"].numpy(), 2, axis=1)[0]

    report("rllib-ppo", task, act, steps=steps * len(task.game.agents), seconds=seconds)
    algo.stop()
