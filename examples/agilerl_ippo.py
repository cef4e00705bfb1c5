"""IPPO of AgileRL: python examples/agilerl_ippo.py.

AgileRL steps PettingZoo parallel environments in processes of their own, and gives agents of one
group, here ``agent_0`` and ``agent_1``, one policy.  It writes NaN for agents that have left, which
can reach the networks; with ``together=True`` none leaves before the last.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from agilerl.algorithms import IPPO
from agilerl.training.train_multi_agent_on_policy import train_multi_agent_on_policy
from agilerl.vector.pz_async_vec_env import AsyncPettingZooVecEnv
from figures import report
from task import cpu_seconds, read_task

from baselines import ShapedEnv


class AlignedIPPO(IPPO):
    """IPPO with two errors of AgileRL 2.58 corrected.

    A group of several agents learns from observations in one order and from advantages in another.
    Here the agents of a group are further copies of one.  And the training loop forgets each end of
    an episode in which all agents end together.  Here an episode begins where the clock is 0.
    """

    def assemble_shared_inputs(self, experience: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Return what each group learns from, its agents side by side."""
        axis = int(isinstance(next(iter(experience.values())), list))  # after that of steps
        groups = super().assemble_shared_inputs(experience)
        return {
            group: {group: np.concatenate([np.asarray(own) for own in agents.values()], axis=axis)}
            for group, agents in groups.items()
        }

    def learn(self, experiences: tuple[Mapping[str, Any], ...]) -> dict[str, float]:
        """Learn from a rollout; the fifth part is whether an episode has ended before a step."""
        parts = list(experiences)
        parts[4] = {
            name: [np.asarray(observed)[:, CLOCK] == 0 for observed in steps]
            for name, steps in parts[0].items()
        }
        return super().learn(tuple(parts))


if __name__ == "__main__":
    torch.manual_seed(1)
    np.random.seed(1)
    torch.set_num_threads(1)  # the networks are small
    task = read_task(steps=50_000)  # of the environment; each moves all agents
    CLOCK = 2 * task.game.dim + 1  # after own state, own place and whether the agent is in traffic
    env = AsyncPettingZooVecEnv([lambda: ShapedEnv(task.game, together=True, **task.rules)] * 4)
    names = env.agents
    learner = AlignedIPPO(
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
    actor = learner.actors[learner.get_group_id(names[0])]
    torch.nn.init.constant_(actor.head_net.log_std, -0.5)
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

    def act(_: int, observations: np.ndarray) -> np.ndarray:
        """Return the mean action."""
        with torch.no_grad():
            actor(torch.as_tensor(observations))
            return actor.head_net.dist.mu.numpy()

    steps = learner.steps * len(names)
    report("agilerl-ippo", task, act, steps=steps, seconds=seconds)
