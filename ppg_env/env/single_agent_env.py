"""One learner against frozen players, as a Gymnasium environment.

This is the learning analogue of a best response: the policies of all other agents are fixed and
become part of the dynamics.  Observations, actions and rewards are those of the learner in
:class:`ppg_env.env.parallel_env.PathPlanningEnv`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np

from ppg_env.env.actions import player_action
from ppg_env.env.argument_checks import check_learner, check_options
from ppg_env.env.parallel_env import RENDER_MODES, PathPlanningEnv
from ppg_env.env.players import Player, straight_players
from ppg_env.env.randomize import Randomize
from ppg_env.env.reset_options import for_learner, refuse_missing_learner
from ppg_env.env.seeds import whole_seed
from ppg_env.errors import InputError
from ppg_env.game.game import Game


class SingleAgentEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """The game seen by one agent.

    Parameters
    ----------
    game
        As in :class:`~ppg_env.env.parallel_env.PathPlanningEnv`.
    learner
        Index of the agent that the actions control.
    players
        Player of each other agent, by index; agents without an entry track their straight plans,
        or head straight for their goals in episodes with other starts or goals than the game's.
    **options
        Observation, ``randomize``, rules and overrides, as in
        :class:`~ppg_env.env.parallel_env.PathPlanningEnv`.
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
        check_options(options, type(self))
        self._env = PathPlanningEnv(game, render_mode=render_mode, **options)
        self.game, self.render_mode = self._env.game, render_mode
        count = len(self.game.agents)
        check_learner(learner, players, count)
        self.learner, self._name = int(learner), self._env.possible_agents[learner]
        refuse_missing_learner(self._env.randomize, None, self.game, learner)
        self.rules = self._env.rules
        self.players = {
            i: player for i, player in enumerate(straight_players(self.game)) if i != learner
        } | dict(players or {})
        self.observation_space = self._env.observation_space(self._name)
        self.action_space = self._env.action_space(self._name)
        self._sizes = [agent.control_dim for agent in self.game.agents]
        self._was_reset = False

    @property
    def randomize(self) -> Randomize | None:
        """What every episode draws; a change of distributions holds from the next episode on."""
        return self._env.randomize

    @randomize.setter
    def randomize(self, rule: Randomize | None) -> None:
        refuse_missing_learner(rule, None, self.game, self.learner)
        self._env.randomize = rule

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode; a ``seed`` fixes the noise and draws of this and of later episodes.

        ``options`` are values of this episode alone (:mod:`ppg_env.env.reset_options`).
        """
        super().reset(seed=None if seed is None else whole_seed(seed))
        options = for_learner(options, self.learner)
        refuse_missing_learner(None, options, self.game, self.learner)
        observations, infos = self._env.reset(seed, options)
        self._was_reset = True
        return observations[self._name], infos[self._name]

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Play ``action`` against the frozen players."""
        if self._name not in self._env.agents:
            when = "after the episode's end" if self._was_reset else "before the first reset"
            raise InputError("step", f"comes {when}", "call reset first")
        actions = {self._name: action}
        simulator = self._env.simulator
        for i, player in self.players.items():
            name = self._env.possible_agents[i]
            if name in self._env.agents:
                actions[name] = player_action(player, simulator.view(i), i, self._sizes[i])[0]
        observations, rewards, terminated, truncated, infos = self._env.step(actions)
        name = self._name
        return observations[name], rewards[name], terminated[name], truncated[name], infos[name]

    def render(self) -> Any:
        """Return what the underlying environment renders."""
        return self._env.render()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._env.close()
