"""One learner against frozen players, as a Gymnasium environment.

The learning analogue of a best response: everybody else's policy is fixed and becomes part of
the world.  Observations, actions and rewards are those of the learner in
:class:`ppg_env.env.parallel_env.PathPlanningEnv`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np

from ppg_env.env.parallel_env import RENDER_MODES, PathPlanningEnv
from ppg_env.env.players import Player, straight_players
from ppg_env.errors import require
from ppg_env.game.game import Game


class SingleAgentEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """The game seen by one agent.

    Parameters
    ----------
    game
        As in :class:`~ppg_env.env.parallel_env.PathPlanningEnv`.
    learner
        Index of the agent to be controlled.
    players
        Player of each other agent, by index; those not named fly straight.
    **options
        Rules and overrides, as in :class:`~ppg_env.env.parallel_env.PathPlanningEnv`.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 4}  # noqa: RUF012 - as Gymnasium

    def __init__(
        self,
        game: Game | str = "opposing",
        learner: int = 0,
        players: Mapping[int, Player] | None = None,
        *,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        self._env = PathPlanningEnv(game, render_mode=render_mode, **options)
        self.game, self.render_mode = self._env.game, render_mode
        count = len(self.game.agents)
        require(0 <= learner < count, "learner", f"is {learner} of {count}", "count from 0")
        strange = [i for i in players or {} if not 0 <= i < count or i == learner]
        require(not strange, "players", f"names agent {strange[:1]}", "name the other agents only")
        self.learner, self._name = learner, self._env.possible_agents[learner]
        self._players = {
            i: player for i, player in enumerate(straight_players(self.game)) if i != learner
        } | dict(players or {})
        self.observation_space = self._env.observation_space(self._name)
        self.action_space = self._env.action_space(self._name)
        self._seen: dict[str, np.ndarray] = {}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; a ``seed`` fixes its noise and that of later ones."""
        super().reset(seed=seed)
        self._seen, infos = self._env.reset(seed, options)
        return self._seen[self._name], infos[self._name]

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Play ``action`` against the frozen players."""
        require(
            self._name in self._env.agents, "step", "comes after the episode's end", "call reset"
        )
        actions = {self._name: action}
        for i, player in self._players.items():
            name = self._env.possible_agents[i]
            if name in self._env.agents:
                actions[name] = player.act(self._env.simulator.view(i))[0]
        self._seen, rewards, ended, cut, infos = self._env.step(actions)
        name = self._name
        return self._seen[name], rewards[name], ended[name], cut[name], infos[name]

    def render(self) -> Any:
        """As the underlying environment."""
        return self._env.render()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._env.close()
