"""MAPPO of BenchMARL on the batched environment: python examples/benchmarl_mappo.py.

The task makes a ``GameTorchRLEnv``, which steps all copies at once, as tasks of VMAS do.  A
transform shapes and scales rewards as ``shaped_learner.py`` has it.  BenchMARL has no mask: rows of
agents that wait for the end of their copy, with rewards of zero, are part of what it learns from.
"""

from __future__ import annotations

import tempfile
from typing import Any

import numpy as np
import torch
from benchmarl.algorithms import MappoConfig
from benchmarl.environments import Task, TaskClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models import MlpConfig
from figures import report
from shaped_learner import SCALE, Potential
from task import cpu_seconds, read_task
from tensordict import TensorDict
from torchrl.envs import Transform
from torchrl.envs.utils import ExplorationType, set_exploration_type

from baselines import GameTorchRLEnv


class Shaping(Transform):
    """Adds the change of the potential to rewards, and scales them."""

    def __init__(self, potential: Potential) -> None:
        super().__init__()
        self.potential = potential

    def _step(self, tensordict: Any, next_tensordict: Any) -> Any:
        before, after = (
            torch.as_tensor(self.potential.of_all(d["agents", "observation"].numpy()))
            for d in (tensordict, next_tensordict)
        )
        change = (after - before) * tensordict["agents", "mask"]
        reward = next_tensordict["agents", "reward"] + change.unsqueeze(-1)
        return next_tensordict.set(("agents", "reward"), reward.float() / SCALE)


class PathPlanningClass(TaskClass):
    """A game as a task; ``config`` holds it and the options of its environment."""

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: Any
    ) -> Any:
        """Return what makes copies of the environment."""
        options = {"seed": seed, "device": device} | self.config["rules"]
        return lambda: GameTorchRLEnv(self.config["game"], num_envs, **options)

    def get_env_transforms(self, env: Any) -> list[Transform]:
        """Return the shaping of rewards."""
        return [Shaping(Potential(self.config["game"]))]

    def supports_continuous_actions(self) -> bool:
        """Return True."""
        return True

    def has_render(self, env: Any = None) -> bool:
        """Return False."""
        return False

    supports_discrete_actions = has_render

    def max_steps(self, env: Any) -> int:
        """Return the length of an episode."""
        return env.simulator.max_cycles

    def group_map(self, env: Any) -> dict[str, list[str]]:
        """Return the names of agents by group."""
        return env.group_map

    def observation_spec(self, env: Any) -> Any:
        """Return the observations of one copy."""
        spec = env.full_observation_spec_unbatched.clone()
        del spec["agents", "mask"], spec["agents", "info"]
        return spec

    def action_spec(self, env: Any) -> Any:
        """Return the actions of one copy."""
        return env.full_action_spec_unbatched

    def state_spec(self, env: Any) -> None:
        """Return None: the critic sees all observations."""

    info_spec = action_mask_spec = state_spec  # none

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
    task = read_task(steps=300_000)  # of the environment; each moves all agents
    game = task.game
    config = ExperimentConfig.get_from_yaml()
    config.lr, config.gamma, config.max_n_frames = 1e-3, 0.99, task.steps
    config.on_policy_collected_frames_per_batch, config.on_policy_n_envs_per_worker = 2048, 64
    config.on_policy_n_minibatch_iters, config.on_policy_minibatch_size = 10, 512
    config.evaluation, config.create_json, config.loggers = False, False, []
    config.save_folder = tempfile.mkdtemp()
    benchmark = PathPlanningTask.HEAD_ON.get_task({"game": game, "rules": task.rules})
    mlp = MlpConfig(num_cells=[64, 64], layer_class=torch.nn.Linear, activation_class=torch.nn.Tanh)
    experiment = Experiment(
        benchmark, MappoConfig.get_from_yaml(), mlp, seed=1, config=config, critic_model_config=mlp
    )
    start = cpu_seconds()
    experiment.run()
    seconds, count = cpu_seconds() - start, len(game.agents)
    steps, high = experiment.total_frames * count, experiment.test_env.simulator.high

    def act(agent: int, observations: np.ndarray) -> np.ndarray:
        """Return the most likely action; the policy acts for all agents, ``agent`` is one."""
        seen = torch.as_tensor(observations)[:, None].expand(-1, count, -1)
        batch = TensorDict({"agents": {"observation": seen}}, [len(observations)])
        with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
            return experiment.policy(batch)["agents", "action"][:, agent].numpy() / high[agent]

    report("benchmarl-mappo", task, act, steps=steps, seconds=seconds)
