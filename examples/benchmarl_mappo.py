"""MAPPO of BenchMARL: python examples/benchmarl_mappo.py.

BenchMARL takes the PettingZoo parallel environment through TorchRL's wrapper, as a task of its own.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from benchmarl.algorithms import MappoConfig
from benchmarl.environments import Task
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models import MlpConfig
from figures import report
from shaped_env import ShapedEnv
from tensordict import TensorDict
from torchrl.envs import PettingZooWrapper
from torchrl.envs.utils import ExplorationType, set_exploration_type

from ppg_env import make_game

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 50_000
"""Steps of the environment; each moves all agents."""


class PathPlanningClass(PettingZooClass):
    """A game as a task; ``config`` holds the game."""

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: Any
    ) -> Callable[[], PettingZooWrapper]:
        """Return what makes one environment."""
        return lambda: PettingZooWrapper(
            ShapedEnv(self.config["game"]), return_state=True, device=device, seed=seed
        )

    def supports_continuous_actions(self) -> bool:
        """Return True."""
        return True

    def supports_discrete_actions(self) -> bool:
        """Return False."""
        return False

    def has_state(self) -> bool:
        """Return True: ``state()`` is for the critic."""
        return True

    def has_render(self, env: Any) -> bool:
        """Return False."""
        return False

    def max_steps(self, env: Any) -> int:
        """Return the length of an episode."""
        return 2 * self.config["game"].horizon

    @staticmethod
    def env_name() -> str:
        """Return the name of the family of tasks."""
        return "path_planning"


class PathPlanningTask(Task):
    """The tasks."""

    HEAD_ON = None

    @staticmethod
    def associated_class() -> type:
        """Return the class that makes environments."""
        return PathPlanningClass


if __name__ == "__main__":
    torch.set_num_threads(1)  # the networks are small
    game = make_game("head_on", speed="l1", lam=0.8)
    config = ExperimentConfig.get_from_yaml()
    config.lr, config.gamma, config.max_n_frames = 1e-3, 0.99, STEPS
    config.on_policy_collected_frames_per_batch = 2048
    config.on_policy_n_envs_per_worker = 8
    config.on_policy_n_minibatch_iters, config.on_policy_minibatch_size = 10, 512
    config.evaluation, config.loggers, config.create_json = False, [], False
    config.save_folder = tempfile.mkdtemp()
    task = PathPlanningTask.HEAD_ON.get_task({"game": game})
    mlp = MlpConfig(num_cells=[64, 64], layer_class=torch.nn.Linear, activation_class=torch.nn.Tanh)
    experiment = Experiment(
        task, MappoConfig.get_from_yaml(), mlp, seed=1, config=config, critic_model_config=mlp
    )
    start = time.time()
    experiment.run()
    seconds = time.time() - start

    def act(agent: int, observations: np.ndarray) -> np.ndarray:
        """Return the mean action; the policy acts for the whole group, ``agent`` is one of it."""
        count = len(game.agents)
        seen = torch.as_tensor(observations)[:, None].expand(-1, count, -1)
        batch = TensorDict({"agent": {"observation": seen}}, [len(observations)])
        with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
            return experiment.policy(batch)["agent", "action"][:, agent].numpy()

    steps = experiment.total_frames * len(game.agents)
    report("benchmarl-mappo", game, act, steps=steps, seconds=seconds)
