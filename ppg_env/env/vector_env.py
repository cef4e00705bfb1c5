"""Many copies of the single-agent game in one simulator, as a Gymnasium vector environment.

    envs = GameVectorEnv("head_on", 64)
    observations, infos = envs.reset(seed=0)
    observations, rewards, terminations, truncations, infos = envs.step(actions)   # (64, m)

The learner plays against frozen players, as in :mod:`ppg_env.env.single_agent_env`.  A copy ends
when the learner's episode ends; what becomes of it then is declared as Gymnasium does, in
``metadata["autoreset_mode"]``:

``SameStep``
    the copy is reset in that step; ``infos["final_obs"]`` and ``infos["final_info"]`` hold the last
    observation and info of the episode
``NextStep``
    the next step resets the copy, ignores its action and has reward 0
``Disabled``
    the client resets copies with ``reset(options={"reset_mask": mask})``
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium.vector
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space

from ppg_env.env.actions import action_numbers, player_action
from ppg_env.env.argument_checks import check_batch_options
from ppg_env.env.observers import make_observer
from ppg_env.env.players import Player
from ppg_env.env.randomize import Randomize
from ppg_env.env.reset_options import checked_mapping, for_learner, refuse_missing_learner
from ppg_env.env.simulator import Simulator
from ppg_env.env.single_agent_env import SingleAgentEnv
from ppg_env.env.status import ARRIVED, TRAFFIC
from ppg_env.errors import InputError, require

AutoresetMode: Any = getattr(gymnasium.vector, "AutoresetMode", str)
"""Gymnasium's names of the modes; releases before 1.1 have none, and do not ask."""

MODES = ("SameStep", "NextStep", "Disabled")


class GameVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """``num_envs`` copies of a game, seen by one agent each.

    Arrays that ``reset`` and ``step`` return are the caller's to keep.  Infos are ``arrived`` and
    ``crashed`` (whether the learner has), ``in_traffic``, ``time_cost`` and ``safety_cost``.

    Parameters
    ----------
    game, learner, players, **options
        As in :class:`~ppg_env.env.single_agent_env.SingleAgentEnv`.
    num_envs
        Number of copies.
    autoreset_mode
        ``NextStep`` (Gymnasium's default), ``SameStep`` or ``Disabled``, or an ``AutoresetMode``.

    Raises
    ------
    InputError
        If an option or an action does not fit, or a step comes before a reset.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium

    def __init__(
        self,
        game: Any = "opposing",
        num_envs: int = 1,
        *,
        autoreset_mode: Any = "NextStep",
        learner: int = 0,
        players: Mapping[int, Player] | None = None,
        render_mode: None = None,
        observation: str = "relative",
        randomize: Randomize | None = None,
        **options: Any,
    ) -> None:
        self._mode = getattr(autoreset_mode, "value", autoreset_mode)
        require(
            self._mode in MODES,
            "autoreset_mode",
            f"is {autoreset_mode!r}",
            "write " + " or ".join(MODES),
        )
        check_batch_options({"render_mode": render_mode, **options}, type(self))
        self.metadata = {**self.metadata, "autoreset_mode": AutoresetMode(self._mode)}
        single = SingleAgentEnv(game, learner, players, randomize=randomize, **options)
        self.game, self.learner, self.num_envs = single.game, learner, num_envs
        self._players = single.players
        self.simulator = Simulator(single.game, single.rules, num_envs, None, randomize)
        self._observer = make_observer(self.simulator, observation)
        self.single_observation_space: Box = self._observer.space
        self.single_action_space = single.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._actions = np.zeros((num_envs, *self.simulator.low.shape))
        self._inputs = single.game.agents[learner].control_dim
        self._waiting = np.ones(num_envs, dtype=np.bool_)
        self._arrived, self._crashed = np.zeros((2, num_envs), dtype=np.bool_)
        self._started = False

    @property
    def randomize(self) -> Randomize | None:
        """What every episode draws; a change of distributions holds from the next episodes on."""
        return self.simulator.randomize

    @randomize.setter
    def randomize(self, rule: Randomize | None) -> None:
        refuse_missing_learner(rule, None, self.game, self.learner)
        self.simulator.randomize = rule

    def reset(
        self,
        *,
        seed: int | Sequence[int] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Reset all copies, or those of ``options["reset_mask"]`` (num_envs,).

        A ``seed``, which may be a sequence of numbers, fixes the noise and draws of all copies from
        now on.  Other ``options`` are values of the episodes that begin now
        (:mod:`ppg_env.env.reset_options`); automatic resets have none.
        """
        if seed is not None:
            self.simulator.seed(seed)
        chosen = np.ones(self.num_envs, dtype=np.bool_)
        values = checked_mapping(options)
        if "reset_mask" in values:
            mask = np.asarray(values.pop("reset_mask"))
            require(
                mask.shape == chosen.shape and mask.dtype == np.bool_,
                "reset_mask",
                f"has shape {mask.shape} and type {mask.dtype}",
                f"give an array of {self.num_envs} booleans",
            )
            chosen = mask
        self._begin(chosen, for_learner(values, self.learner))
        self._waiting, self._started = self._waiting & ~chosen, True
        return self._observations(), self._infos(chosen, chosen)

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Play ``actions`` (num_envs, m) against the frozen players."""
        waiting, i = self._waiting, self.learner
        ready = self._started if self._mode == "NextStep" else not waiting.any()
        require(ready, "step", "comes before a reset", "call reset first")
        self._act(actions)
        out = self.simulator.step(self._actions, restart=False)
        rewards = np.where(waiting, 0.0, out.reward[:, i])
        terminations = out.terminated[:, i] & ~waiting
        truncations = out.truncated[:, i] & ~waiting
        ended, infos = terminations | truncations, {}
        self._arrived |= out.arrived[:, i]
        self._crashed |= out.crashed[:, i]
        if self._mode == "SameStep" and ended.any():
            infos = self._final(ended)
        begun = {"SameStep": ended, "NextStep": waiting}.get(self._mode, np.zeros_like(ended))
        if begun.any():
            self._begin(begun)
        self._waiting = ended & ~begun
        infos |= self._infos(np.ones_like(ended), begun)
        return self._observations(), rewards, terminations, truncations, infos

    def _begin(self, chosen: np.ndarray, options: Any = None) -> None:
        refuse_missing_learner(None, options, self.game, self.learner)
        self.simulator.reset(chosen, options=options)
        self._arrived[chosen] = self.simulator.status[chosen, self.learner] == ARRIVED
        self._crashed[chosen] = False

    def _act(self, actions: np.ndarray) -> None:
        """Write what all agents play; actions of copies that wait for a reset are not read."""
        size = self._inputs
        values = action_numbers(actions)
        if values.shape != (self.num_envs, size):
            problem = f"are {actions!r:.40}, of shape {values.shape}"
            remedy = f"give one of {size} numbers per copy, shape ({self.num_envs}, {size})"
            raise InputError("actions", problem, remedy)
        values[self._waiting] = 0.0
        require(bool(np.isfinite(values).all()), "actions", "are not finite", "give finite numbers")
        for agent, player in self._players.items():
            inputs = self.game.agents[agent].control_dim
            view = self.simulator.view(agent)
            self._actions[:, agent, :inputs] = player_action(player, view, agent, inputs)
        self._actions[:, self.learner, :size] = values

    def _observations(self) -> np.ndarray:
        """Return what the learner observes in all copies, as a new array."""
        return self._observer.read(self.simulator.last.observation)[:, self.learner].copy()

    def _infos(self, chosen: np.ndarray, begun: np.ndarray) -> dict[str, Any]:
        """Return infos of the ``chosen`` copies, of which those ``begun`` are at time 0."""
        last, i = self.simulator.last, self.learner
        values = {
            "arrived": self._arrived.copy(),
            "crashed": self._crashed.copy(),
            "in_traffic": self.simulator.status[:, i] == TRAFFIC,
            "time_cost": np.where(begun, 0.0, last.time_cost[:, i]),
            "safety_cost": np.where(begun, 0.0, last.safety_cost[:, i]),
        }
        return values | {f"_{key}": chosen.copy() for key in values}

    def _final(self, ended: np.ndarray) -> dict[str, Any]:
        """Return the last observations and infos of the episodes that ``ended``."""
        observations, final = self._observations(), np.full(self.num_envs, None, dtype=object)
        for c in np.flatnonzero(ended):
            final[c] = observations[c]
        infos = self._infos(ended, np.zeros_like(ended))
        return {
            "final_obs": final,
            "_final_obs": ended.copy(),
            "final_info": infos,
            "_final_info": ended.copy(),
        }
