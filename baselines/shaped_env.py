"""The PettingZoo environment with rewards from which learning can start, for other libraries."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from baselines.shaping import RewardShaping
from ppg_env.env.actions import action_numbers
from ppg_env.env.parallel_env import PathPlanningEnv
from ppg_env.game.game import Game


class ShapedEnv(PathPlanningEnv):
    """The environment of :func:`ppg_env.parallel_env`, for trainings by other libraries.

    Rewards are shaped by the time still needed, and scaled (:mod:`baselines.shaping`).
    Observations and infos are those of the game: costs in infos are neither shaped nor scaled.

    **Actions**: ``Box`` of shape (m,), float32, from -1 to 1, the box around the control set;
    entries beyond are clipped.

    Parameters
    ----------
    game, **options
        As in :class:`~ppg_env.PathPlanningEnv`.
    together
        Whether no agent leaves before the last, for libraries that cannot handle agents that leave.
        Those that are done wait, with rewards of 0 and the observations and infos of their last
        step; their actions are ignored.  All terminate together, or all are truncated if the time
        of one of them has run out.
    reward_scale
        Rewards are divided by it.  A crash costs (1 - lam) times the game's ``crash_cost``, by
        default 20 at lam = 0.8.

    Raises
    ------
    InputError
        If an option or an action does not fit, or a step comes before a reset.
    """

    def __init__(
        self,
        game: Game | str | Path = "opposing",
        *,
        together: bool = False,
        reward_scale: float = 20.0,
        **options: Any,
    ) -> None:
        super().__init__(game, **options)
        self._shaping = RewardShaping(self.simulator, True, reward_scale)
        self._together = together
        boxes = self.action_spaces
        self.action_spaces = {
            name: Box(-1.0, 1.0, box.shape, np.float32) for name, box in boxes.items()
        }
        self._middle = {name: (box.high + box.low) / 2 for name, box in boxes.items()}
        self._half = {name: (box.high - box.low) / 2 for name, box in boxes.items()}
        self._playing: list[str] = []

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Start an episode, as :meth:`ppg_env.PathPlanningEnv.reset` does."""
        observations, infos = super().reset(seed, options)
        self._last, self._playing = (observations, infos), self.agents
        return observations, infos

    def step(self, actions: dict[str, Any]) -> Any:
        """Move every living agent; ``actions`` has one entry (m,) from -1 to 1 for each."""
        self.agents = self._playing
        self._shaping.before_step()
        if isinstance(actions, dict):
            actions = {name: self._inputs(name, action) for name, action in actions.items()}
        observations, rewards, terminated, truncated, infos = super().step(actions)
        if not self._playing:
            return observations, rewards, terminated, truncated, infos
        shaped = self._shaping.rewards(self.simulator.last.observation)[0].tolist()
        rewards = {name: shaped[self._index[name]] for name in rewards}
        self._last = self._last[0] | observations, self._last[1] | infos
        self._playing = self.agents
        if not self._together:
            return observations, rewards, terminated, truncated, infos
        present, over, cut = list(self._last[0]), not self._playing, any(truncated.values())
        self.agents = [] if over else present
        return (
            dict(self._last[0]),
            {name: rewards.get(name, 0.0) for name in present},
            dict.fromkeys(present, over and not cut),
            dict.fromkeys(present, over and cut),
            dict(self._last[1]),
        )

    def _inputs(self, name: str, action: Any) -> Any:
        """Return an action in the units of the game; the game refuses one of another shape."""
        values = action_numbers(action)
        if name not in self._half or values.shape != self._half[name].shape:
            return action
        return self._middle[name] + self._half[name] * np.clip(values, -1.0, 1.0)
