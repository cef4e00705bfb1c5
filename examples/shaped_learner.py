"""Shaped and scaled rewards for one learner, and for loops of one's own on the ``Simulator``.

    reward' = (reward + Phi' - Phi) / SCALE

:mod:`baselines.shaping` has the potential Phi, and says what it changes; all environments of
``baselines`` shape by themselves.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from baselines.shaping import straight_pace
from ppg_env.env.observation import observation_frame
from ppg_env.game.game import Game

SCALE = 20.0
"""What a crash costs at lam = 0.8."""


class ShapedLearner(gymnasium.Wrapper):
    """A :class:`ppg_env.SingleAgentEnv` with shaped and scaled rewards."""

    def __init__(self, env: gymnasium.Env) -> None:
        super().__init__(env)
        single: Any = env.unwrapped
        self._learner, self._potential = single.learner, Potential(single.game)

    def reset(self, **options: Any) -> Any:
        """Start an episode."""
        self._last, info = self.env.reset(**options)
        return self._last, info

    def step(self, action: Any) -> Any:
        """Move all agents."""
        before = self._potential(self._learner, self._last)
        self._last, reward, *rest = self.env.step(action)
        change = self._potential(self._learner, self._last) - before
        return self._last, float(reward + change) / SCALE, *rest


class Potential:
    """Minus the cost of the time that an agent still needs on the straight way."""

    def __init__(self, game: Game) -> None:
        d, n = game.dim, max(agent.state_dim for agent in game.agents)
        lam = np.array([agent.lam for agent in game.agents])
        self._place, self._traffic = slice(d), n + d
        self._rates = (lam * straight_pace(game, observation_frame(game)[1])).tolist()

    def __call__(self, agent: int, observation: np.ndarray) -> np.ndarray:
        """Return the potential (...,) of an agent, by index, for its observations (..., W)."""
        away = np.linalg.norm(observation[..., self._place], axis=-1)
        potential: np.ndarray = -self._rates[agent] * away * observation[..., self._traffic]
        return potential

    def of_all(self, observations: np.ndarray) -> np.ndarray:
        """Return the potentials (C, N) of all agents, for observations (C, N, W)."""
        agents = range(observations.shape[1])
        return np.stack([self(i, observations[:, i]) for i in agents], axis=1)
