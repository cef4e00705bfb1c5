"""PufferLib's view of a game: many copies in one simulator, one row per copy and agent.

    env = GamePufferEnv("head_on", 64)
    observations, infos = env.reset(seed=0)
    observations, rewards, terminals, truncations, infos = env.step(actions)       # (64 N, m)

Row ``c * N + i`` is agent i in copy c.  The arrays are PufferLib's buffers, in shared memory where
it runs several processes, and the next step overwrites them.

A copy restarts in the step in which its last agent ends, and observations are then the first ones
of the new episode.  An agent that ends earlier has ``terminals`` set in that step; then its row
waits, with rewards of zero and ``masks`` unset.  When the copy restarts, ``terminals`` of *all* its
rows are set, so that no advantage passes from one episode to the next: at the time limit as well,
where ``truncations`` are set in addition, because PufferLib's trainer reads only the former.

Actions are in [-1, 1], the box around all control sets of the agent.  PufferLib's trainer cuts
rewards off at 1 in size: choose ``reward_scale`` so that a crash costs at most that.  With
``shaping`` rewards are those of :mod:`baselines.shaping`.

Steps in which copies end report the means over these copies and their agents: ``episode_length``,
``episode_return`` (neither shaped nor scaled), ``cost`` (minus the selfish return), ``arrived``
and ``crashed``.  Agents that are missing from an episode (``randomize``) have ``masks`` unset, and
count as agents that neither pay nor arrive.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from baselines.shaping import RewardShaping
from ppg_env.env.argument_checks import check_batch_options
from ppg_env.env.observers import make_observer
from ppg_env.env.parallel_env import PathPlanningEnv
from ppg_env.env.randomize import Randomize
from ppg_env.env.simulator import Simulator
from ppg_env.errors import InputError
from ppg_env.game.game import Game

try:
    import pufferlib
except ImportError as missing:
    sentence = "GamePufferEnv: needs PufferLib; install path-planning-games[puffer]."
    raise ImportError(sentence) from missing


class GamePufferEnv(pufferlib.PufferEnv):
    """``copies`` of a game as a native PufferLib environment.

    Parameters
    ----------
    game, observation, randomize, **options
        As in :class:`~ppg_env.PathPlanningEnv`.
    copies
        Number of copies.
    shaping
        Whether rewards are shaped by the time still needed (:mod:`baselines.shaping`).
    reward_scale
        Rewards are divided by it.
    buf, seed
        Given by PufferLib: buffers, and the seed of all noise, None for fresh entropy.

    Raises
    ------
    InputError
        If an option or an action does not fit, or a step comes before a reset.
    """

    def __init__(
        self,
        game: Game | str | Path = "opposing",
        copies: int = 1,
        *,
        observation: str = "relative",
        randomize: Randomize | None = None,
        shaping: bool = False,
        reward_scale: float = 1.0,
        buf: Any = None,
        seed: int | None = None,
        **options: Any,
    ) -> None:
        check_batch_options(options, type(self))
        single = PathPlanningEnv(game, randomize=randomize, **options)
        self.game = single.game
        self.simulator = Simulator(single.game, single.rules, copies, seed, randomize)
        self._shaping = RewardShaping(self.simulator, shaping, reward_scale)
        self._observer = make_observer(self.simulator, observation)
        low, high = self.simulator.low, self.simulator.high
        self._middle, self._half = (high + low) / 2, (high - low) / 2
        self._shape = self.simulator.status.shape
        self._return, self._cost = np.zeros((2, *self._shape))
        self._arrived, self._crashed = np.zeros((2, *self._shape), dtype=np.bool_)
        self._length = np.zeros(copies, dtype=np.int64)
        self.single_observation_space: Box = self._observer.space
        self.single_action_space = Box(-1.0, 1.0, (self.simulator.action_size,), np.float32)
        self.num_agents = copies * self._shape[1]
        super().__init__(buf)

    @property
    def randomize(self) -> Randomize | None:
        """What every episode draws; a change of distributions holds from the next episodes on."""
        return self.simulator.randomize

    @randomize.setter
    def randomize(self, rule: Randomize | None) -> None:
        self.simulator.randomize = rule

    def reset(self, seed: int | None = None) -> tuple[np.ndarray, list[dict[str, float]]]:
        """Restart all copies; a ``seed`` fixes their noise from now on."""
        if seed is not None:
            self.simulator.seed(seed)
        self.simulator.reset()
        self._forget(np.ones(self._shape[0], dtype=np.bool_))
        for flags in (self.rewards, self.terminals, self.truncations):
            flags[:] = 0
        self._observe()
        return self.observations, []

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[dict[str, float]]]:
        """Step every copy by ``actions`` (rows, m)."""
        given, shape = np.asarray(actions), self.action_space.shape
        if given.shape != shape or given.dtype.kind not in "iuf":
            problem = f"are an array of shape {given.shape} and type {given.dtype}"
            raise InputError("actions", problem, f"give numbers of shape {shape}")
        inputs = self._middle + self._half * given.reshape(*self._shape, -1)
        self._shaping.before_step()
        out = self.simulator.step(inputs)
        over = out.over
        last = np.where(over[:, None, None], out.final_observation, out.observation)
        self.rewards[:] = self._shaping.rewards(last).ravel()
        self.terminals[:] = (out.terminated | over[:, None]).ravel()
        self.truncations[:] = out.truncated.ravel()
        self._length += 1
        self._return += out.reward
        self._cost += out.time_cost + out.safety_cost
        self._arrived |= out.arrived
        self._crashed |= out.crashed
        infos = [self._outcomes(over)] if over.any() else []
        self._forget(over)
        self._observe()
        return self.observations, self.rewards, self.terminals, self.truncations, infos

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.game.name or 'game'!r}, copies={self._shape[0]})"

    def close(self) -> None:
        """Do nothing: there is nothing to close."""

    def _observe(self) -> None:
        """Write observations and masks."""
        observation = self._observer.read(self.simulator.last.observation)
        self.observations[:] = observation.reshape(self.observations.shape)
        self.masks[:] = self.simulator.alive.ravel()

    def _outcomes(self, over: np.ndarray) -> dict[str, float]:
        """Return the means over the copies that are ``over`` and their agents."""
        sums = {
            "episode_return": self._return,
            "episode_length": self._length,
            "cost": self._cost,
            "arrived": self._arrived,
            "crashed": self._crashed,
        }
        return {key: float(values[over].mean()) for key, values in sums.items()}

    def _forget(self, chosen: np.ndarray) -> None:
        for values in (self._return, self._cost, self._arrived, self._crashed, self._length):
            values[chosen] = 0
