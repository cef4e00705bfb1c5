"""PPO of Tianshou, one agent after the other: python examples/tianshou_ppo.py.

Tianshou's ``PettingZooEnv`` is for games in turns: where all agents move at once it credits rewards
only to the last of them, and it ends an episode when the first agent leaves.  So each agent learns
in the Gymnasium environment, against the others as they are then: iterated best response.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import torch
from figures import Act, TrainedPlayer, report
from shaped_learner import ShapedLearner
from task import Task, cpu_seconds, read_task
from tianshou.algorithm.modelfree.ppo import PPO
from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv
from tianshou.trainer import OnPolicyTrainerParams
from tianshou.utils.net.common import Net
from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic
from torch.distributions import Independent, Normal

from ppg_env import SingleAgentEnv

ROUNDS = 1
"""How often each agent learns.  A second round of 14,000 steps each made agents crash again."""


def shaped_env(task: Task, learner: int, acts: dict[int, Act]) -> gymnasium.Env:
    """Return the game for one learner; ``acts`` are the policies of others, by index."""
    players = {i: TrainedPlayer(task.game, i, act) for i, act in acts.items() if i != learner}
    env = SingleAgentEnv(task.game, learner, players, **task.rules)
    return ShapedLearner(gymnasium.wrappers.RescaleAction(env, np.float32(-1), np.float32(1)))


def make_ppo(env: gymnasium.Env) -> PPO:
    """Return PPO with two networks of two hidden layers."""
    shape = env.observation_space.shape
    bodies = [Net(state_shape=shape, hidden_sizes=[64, 64], activation=torch.nn.Tanh) for _ in "ac"]
    actor = ContinuousActorProbabilistic(
        preprocess_net=bodies[0], action_shape=env.action_space.shape, unbounded=True
    )
    torch.nn.init.constant_(actor.sigma_param, -0.5)
    policy = ProbabilisticActorPolicy(
        actor=actor,
        dist_fn=lambda loc_scale: Independent(Normal(*loc_scale), 1),
        deterministic_eval=True,
        action_space=env.action_space,
    )
    critic = ContinuousCritic(preprocess_net=bodies[1])
    return PPO(policy=policy, critic=critic, optim=AdamOptimizerFactory(lr=1e-3), ent_coef=0.0)


def mean_action(algorithm: PPO) -> Act:
    """Return the policy as a function of observations."""

    def act(_: int, observations: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return algorithm.policy.actor(observations)[0][0].numpy()

    return act


if __name__ == "__main__":
    torch.manual_seed(1)
    np.random.seed(1)  # Tianshou draws minibatches from it
    torch.set_num_threads(1)  # the networks are small
    task = read_task(steps=200_000)  # of the learners, in all
    agents = range(len(task.game.agents))
    algorithms = [make_ppo(shaped_env(task, i, {})) for i in agents]
    acts: dict[int, Act] = {}  # at first the others follow their straight plans
    start, each, steps = cpu_seconds(), -(-task.steps // (ROUNDS * len(agents))), 0
    for turn in range(ROUNDS * len(agents)):
        i = turn % len(agents)
        envs = DummyVectorEnv([lambda i=i: shaped_env(task, i, acts)] * 8)
        envs.seed(8 * turn)
        collector = Collector[Any](algorithms[i], envs, VectorReplayBuffer(2048, 8))
        collector.reset()
        algorithms[i].run_training(
            OnPolicyTrainerParams(
                training_collector=collector,
                max_epochs=1,
                epoch_num_steps=each,
                collection_step_num_env_steps=min(2048, each),
                batch_size=512,
                update_step_num_repetitions=10,
                show_progress=False,
                verbose=False,
            )
        )
        acts[i], steps = mean_action(algorithms[i]), steps + collector.collect_step
    seconds = cpu_seconds() - start

    def act(agent: int, observations: np.ndarray) -> np.ndarray:
        """Return the mean action of the agent's own policy."""
        return acts[agent](agent, observations)

    report("tianshou-ppo", task, act, steps=steps, seconds=seconds)
