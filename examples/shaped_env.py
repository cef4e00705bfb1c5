"""The PettingZoo environment with the changes that let learning start from nothing.

    actions   from -1 to 1 per component, the box around the control set
    shaping   reward + Phi' - Phi,  Phi = -lam * (steps to go on the straight way), 0 out of traffic
    scale     rewards are divided by ``SCALE``, so that a crash costs about 1
    together  with ``together=True`` no agent leaves before the last: those that are done wait, with
              rewards of 0, and what they observe says that they are out of traffic

The shaping telescopes (Ng et al., 1999).  Where an agent arrives or crashes, it changes the return
by a constant, what the straight way costs.  Where its time runs out, Phi keeps its value, and the
return is lower than that by what the way that is left would cost: with Phi set to 0 there, hiding
would be paid like an arrival.  Without shaping, an agent that has never reached its goal knows
nothing of it.
Figures are always those of the game itself, see ``figures.py``.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from ppg_env import PathPlanningEnv
from ppg_env.env.observation import observation_frame
from ppg_env.game.game import Game
from ppg_env.game.reachability import earliest_arrival

SCALE = 20.0
"""What a crash costs at lam = 0.8."""


class ShapedEnv(PathPlanningEnv):
    """A game for learning; other arguments are those of :func:`ppg_env.parallel_env`."""

    def __init__(self, game: Any = "opposing", *, together: bool = False, **options: Any) -> None:
        super().__init__(game, **options)
        self._together, self._potential = together, Potential(self.game)
        boxes = self.action_spaces
        self.action_spaces = {
            name: Box(-1.0, 1.0, box.shape, np.float32) for name, box in boxes.items()
        }
        self._middle = {name: (box.high + box.low) / 2 for name, box in boxes.items()}
        self._half = {name: (box.high - box.low) / 2 for name, box in boxes.items()}

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Start an episode."""
        observations, infos = super().reset(seed, options)
        self._last, self._playing = (observations, infos), self.agents
        return observations, infos

    def step(self, actions: dict[str, Any]) -> Any:
        """Move every living agent; ``actions`` are from -1 to 1."""
        self.agents = self._playing
        inputs = {name: self._inputs(name, action) for name, action in actions.items()}
        observations, rewards, terminated, truncated, infos = super().step(inputs)
        for name in rewards:
            i = self.possible_agents.index(name)
            change = self._potential(i, observations[name]) - self._potential(
                i, self._last[0][name]
            )
            rewards[name] = float(rewards[name] + change) / SCALE
        self._last = self._last[0] | observations, self._last[1] | infos
        self._playing = self.agents
        if not self._together:
            return observations, rewards, terminated, truncated, infos
        cut = any(truncated.values())
        over = not self.agents
        self.agents = [] if over else self.possible_agents[:]
        return (
            dict(self._last[0]),
            {name: rewards.get(name, 0.0) for name in self.possible_agents},
            dict.fromkeys(self.possible_agents, over and not cut),
            dict.fromkeys(self.possible_agents, over and cut),
            dict(self._last[1]),
        )

    def _inputs(self, name: str, action: Any) -> Any:
        """Return an action in the units of the game; the game refuses one of another shape."""
        if name not in self._half or np.shape(action) != self._half[name].shape:
            return action
        return self._middle[name] + self._half[name] * np.clip(action, -1.0, 1.0)


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
        scale = observation_frame(game)[1]
        self._place, self._traffic, self._rates = slice(d), n + d, []
        for agent in game.agents:
            length = float(np.linalg.norm(agent.goal[:d] - agent.start[:d]))
            steps = earliest_arrival(agent, game.horizon) or game.horizon
            self._rates.append(agent.lam * steps * scale / length if length else 0.0)

    def __call__(self, agent: int, observation: np.ndarray) -> np.ndarray:
        """Return the potential (...,) of an agent, by index, for its observations (..., W)."""
        away = np.linalg.norm(observation[..., self._place], axis=-1)
        potential: np.ndarray = -self._rates[agent] * away * observation[..., self._traffic]
        return potential

    def of_all(self, observations: np.ndarray) -> np.ndarray:
        """Return the potentials (C, N) of all agents, for observations (C, N, W)."""
        agents = range(observations.shape[1])
        return np.stack([self(i, observations[:, i]) for i in agents], axis=1)
