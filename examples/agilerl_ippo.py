"""IPPO of AgileRL: python examples/agilerl_ippo.py.

AgileRL steps PettingZoo parallel environments in processes of their own, and gives agents of one
group, here ``agent_0`` and ``agent_1``, one policy.  It writes NaN for agents that have left, which
can reach the networks; with ``together=True`` none leaves before the last.
"""

from __future__ import annotations

import numpy as np
import torch
from agilerl.algorithms import IPPO
from agilerl.training.train_multi_agent_on_policy import train_multi_agent_on_policy
from agilerl.vector.pz_async_vec_env import AsyncPettingZooVecEnv
from figures import report
from shaped_env import ShapedEnv
from task import cpu_seconds, read_task

if __name__ == "__main__":
    torch.manual_seed(1)
    torch.set_num_threads(1)  # the networks are small
    task = read_task(steps=50_000)  # of the environment; each moves all agents
    env = AsyncPettingZooVecEnv([lambda: ShapedEnv(task.game, together=True, **task.rules)] * 4)
    names = env.agents
    learner = IPPO(
        [env.single_observation_space(name) for name in names],
        [env.single_action_space(name) for name in names],
        agent_ids=names,
        net_config={
            "encoder_config": {"hidden_size": [64, 64], "activation": "Tanh"},
            "head_config": {"hidden_size": [64], "activation": "Tanh"},
        },
        batch_size=256,
        lr=1e-3,
        learn_step=1024,
        gamma=0.99,
        action_std_init=0.0,  # the logarithm, and at least 0
        ent_coef=0.0,
        update_epochs=10,
    )
    start = cpu_seconds()
    train_multi_agent_on_policy(
        env,
        "path planning",
        "IPPO",
        [learner],
        sum_scores=False,
        max_steps=task.steps,
        evo_steps=min(8192, task.steps),
        verbose=False,
    )
    env.close()
    seconds = cpu_seconds() - start

    actor = learner.actors[learner.get_group_id(names[0])]

    def act(_: int, observations: np.ndarray) -> np.ndarray:
        """Return the mean action."""
        with torch.no_grad():
            actor(torch.as_tensor(observations))
            return actor.head_net.dist.mu.numpy()

    steps = learner.steps * len(names)
    report("agilerl-ippo", task, act, steps=steps, seconds=seconds)
