r"""Stable-baselines3's view of a game: many copies, stepped at once, one slot per copy and learner.

Slot ``c * L + l`` is the l-th learner in copy c.  Observations and rewards are those of the
environment, with three optional changes:

    weight    lam is drawn for every episode of a copy, and is the last entry of observations
    shaping   of rewards by the time still needed, see :mod:`baselines.shaping`: the goal need not
              be found by chance
    scale     rewards are divided by it

At the horizon an agent is reported as ``TimeLimit.truncated``, and algorithms add an estimate of
the remaining return.  With ``bootstrap=False`` the episode ends there instead, and the shaping
charges the straight way that is left: time is observed and limited, and an estimate beyond the
horizon has no data to learn from.

Learners in a copy finish at different times.  A finished learner waits, with rewards of zero, until
the copy restarts; then *every* slot of the copy reports done, so that no advantage passes from one
episode to the next.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from stable_baselines3.common.vec_env import VecEnv

from baselines.shaping import RewardShaping
from baselines.slots import check_modes, checked_weights, common_options, slot_actions
from ppg_env.env.actions import player_action
from ppg_env.env.argument_checks import check_learners
from ppg_env.env.players import Player, straight_players
from ppg_env.env.randomize import Randomize
from ppg_env.env.reset_options import for_learner, refuse_missing_learner
from ppg_env.env.rules import Rules
from ppg_env.env.seeds import seed_sequence
from ppg_env.env.simulator import Simulator
from ppg_env.errors import InputError, require
from ppg_env.game.game import Game

REWARD_SCALE = 10.0
"""A crash at lam = 0.5 then costs 5, an episode about 0.5: of order one, as PPO assumes."""


class GameVecEnv(VecEnv):
    """``copies`` of ``game`` as a ``VecEnv``; actions are in [-1, 1], the box around the controls.

    If an agent's control set changes over time, that box contains all of its sets, and the
    environment projects on the current one: an action means the same input at all times.

    Parameters
    ----------
    game, rules, copies
        As in :class:`~ppg_env.Simulator`.
    learners
        Agents with a slot in each copy; all by default.
    players
        Players of the others, by index; by default they follow their straight plans.
    weights
        Range (low, high) from which each episode of a copy draws lam for all its agents; None
        for the game's own.
    randomize
        What every episode draws, as in :class:`~ppg_env.Simulator`; observations say it.  May be
        replaced during training, as in ``env.set_attr("randomize", rule)``.
    shaping, reward_scale, bootstrap
        See the top of this file.
    render_mode
        ``rgb_array`` for pictures of the first copy, by ``render`` and ``VecVideoRecorder``.
    """

    def __init__(
        self,
        game: Game,
        rules: Rules | None = None,
        copies: int = 64,
        *,
        learners: Sequence[int] | None = None,
        players: Mapping[int, Player] | None = None,
        weights: tuple[float, float] | None = None,
        randomize: Randomize | None = None,
        shaping: bool = True,
        reward_scale: float = REWARD_SCALE,
        bootstrap: bool = True,
        seed: int = 0,
        render_mode: str | None = None,
    ) -> None:
        self.simulator = Simulator(game, rules, copies, randomize=randomize)
        count = len(game.agents)
        self.learners = check_learners(learners, players, count)
        check_modes(bootstrap, render_mode)
        self.players = {
            i: player for i, player in enumerate(straight_players(game)) if i not in self.learners
        } | dict(players or {})
        self.weights = checked_weights(weights)
        self._refuse_conflicts(randomize)
        self._shaping = RewardShaping(self.simulator, shaping, reward_scale)
        self._bootstrap = bootstrap
        low, high = self.simulator.low, self.simulator.high
        self._middle, self._half = (high + low) / 2, (high - low) / 2
        self._action = np.zeros((copies, count, self.simulator.action_size))
        self._shape = (copies, len(self.learners))
        self._sizes = [agent.control_dim for agent in game.agents]
        self.render_mode, self._was_reset = render_mode, False
        self._viewer: Any = None
        size = self.simulator.observation_size + (weights is not None)
        self.seed(seed)
        super().__init__(
            copies * len(self.learners),
            Box(-np.inf, np.inf, (size,), np.float32),
            Box(-1.0, 1.0, (self.simulator.action_size,), np.float32),
        )
        self.set_attr("metadata", self.metadata | {"render_fps": 4})

    @property
    def randomize(self) -> Randomize | None:
        """What every episode draws; a change of distributions holds from the next episodes on."""
        return self.simulator.randomize

    @randomize.setter
    def randomize(self, rule: Randomize | None) -> None:
        self._refuse_conflicts(rule)
        self.simulator.randomize = rule

    def _refuse_conflicts(self, rule: Randomize | None) -> None:
        """Refuse a rule that draws lam a second time, or episodes without a learner."""
        twice = rule is not None and rule.lam is not None and self.weights is not None
        require(not twice, "weights", "and randomize both draw lam", "give only one of them")
        refuse_missing_learner(rule, None, self.simulator.game, min(self.learners))

    def seed(self, seed: int | None = None) -> list[int | None]:
        """Seed all noise; takes effect at once and continues over resets."""
        noise, weights = seed_sequence(seed).spawn(2)
        self.simulator.seed(noise)
        self._random = np.random.default_rng(weights)
        return [seed] * int(np.prod(self._shape))

    def reset(self) -> np.ndarray:
        """Restart every copy; returns observations (slots, W).

        Options that ``set_options`` has set for all slots are values of the episodes that begin now
        (:mod:`ppg_env.env.reset_options`); a given lam is not drawn.
        """
        options = self._common_options()
        self.simulator.reset(options=options)
        self._reset_options()
        self._draw_weights(np.full(len(self._action), "lam" not in options))
        self._was_reset = True
        self._cost = np.zeros(self._shape)
        self._hit = np.zeros(self._shape, dtype=bool)
        self._home = np.zeros(self._shape, dtype=bool)
        self._record()
        return self._observed(self.simulator.last.observation)

    def _common_options(self) -> dict[str, Any]:
        """Return the options of all slots; those of the only learner may be one point."""
        options = common_options(self._options)
        if len(self.learners) == 1:
            refuse_missing_learner(None, options, self.simulator.game, self.learners[0])
            options = for_learner(options, self.learners[0])
        return options

    def step_async(self, actions: np.ndarray) -> None:
        """Take the learners' actions (slots, m) and ask the other players for theirs.

        Raises
        ------
        InputError
            If they have another shape, or the environment has not been reset.
        """
        simulator, learners = self.simulator, self.learners
        if not self._was_reset:
            raise InputError("step", "comes before the first reset", "call reset first")
        given = slot_actions(actions, (self.num_envs, simulator.action_size))
        own = self._half[learners] * given.reshape(*self._shape, -1)
        self._action[:, learners] = self._middle[learners] + own
        for i, player in self.players.items():
            size = self._sizes[i]
            self._action[:, i, :size] = player_action(player, simulator.view(i), i, size)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Step every copy; copies in which no learner is left restart."""
        simulator, own = self.simulator, self.learners
        self._shaping.before_step()
        out = simulator.step(self._action, restart=False)
        reward = self._shaping.rewards(out.observation)[:, own]
        self._cost += (out.time_cost + out.safety_cost)[:, own]
        self._hit |= out.crashed[:, own]
        self._home |= out.arrived[:, own]
        self._record()
        over = np.all(~simulator.alive[:, own], axis=1)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if over.any():
            self._finish(over, infos)
            simulator.reset(over)
            self._draw_weights(over)
            if over[0]:
                self._record()  # time 0 of the next episode
        done = np.repeat(over, len(own))
        observed = self._observed(simulator.last.observation)
        return observed, reward.ravel().astype(np.float32), done, infos

    def normalised(self, agent: int, action: np.ndarray) -> np.ndarray:
        """Return an agent's inputs (C, m_i) as actions (C, m), clipped to [-1, 1]."""
        size, result = action.shape[1], np.zeros((len(action), self.simulator.action_size))
        half = self._half[agent, :size]
        result[:, :size] = (action - self._middle[agent, :size]) / np.where(half > 0, half, 1.0)
        return np.clip(result, -1.0, 1.0)

    def inputs(self, agent: int, action: np.ndarray) -> np.ndarray:
        """Return actions (..., m_i) in [-1, 1] as the inputs of ``agent``."""
        size = action.shape[-1]
        inputs: np.ndarray = self._middle[agent, :size] + self._half[agent, :size] * action
        return inputs

    def _finish(self, over: np.ndarray, infos: list[dict[str, Any]]) -> None:
        """Record the outcomes of ended episodes, and their last observations."""
        last, cut = self._observed(self.simulator.last.observation), self.simulator.last.truncated
        count = len(self.learners)
        for c in np.flatnonzero(over).tolist():
            for k, agent in enumerate(self.learners):
                infos[c * count + k] = {
                    "terminal_observation": last[c * count + k],
                    "TimeLimit.truncated": self._bootstrap and bool(cut[c, agent]),
                    "is_success": bool(self._home[c, k]),
                    "crashed": bool(self._hit[c, k]),
                    "cost": float(self._cost[c, k]),
                }
        self._cost[over], self._hit[over], self._home[over] = 0.0, False, False

    def _observed(self, observation: np.ndarray) -> np.ndarray:
        """Return the learners' observations (slots, W), a copy; lam is last if it varies."""
        observed = observation[:, self.learners]
        if self.weights is not None:
            lam = self.simulator.lam[:, self.learners, None].astype(np.float32)
            observed = np.concatenate([observed, lam], axis=2)
        return observed.reshape(-1, observed.shape[2])

    def _draw_weights(self, chosen: np.ndarray) -> None:
        if self.weights is not None:
            fresh = self._random.uniform(*self.weights, size=(int(chosen.sum()), 1))
            self.simulator.lam[chosen] = fresh

    def get_images(self) -> list[np.ndarray]:
        """Return a picture of the first copy."""
        require(self._was_reset, "render", "comes before the first reset", "call reset first")
        if self._viewer is None:
            from ppg_env.env.viewer import Viewer

            self._viewer = Viewer(self.simulator.game, fps=4)
            self._record()
        return [self._viewer.frame()]

    def _record(self) -> None:
        if self._viewer is not None:
            self._viewer.record(self.simulator)

    def close(self) -> None:
        """Do nothing: there is nothing to close."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return the attribute, once per slot in ``indices``."""
        return [getattr(self, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of all slots."""
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method, once for all slots; return its result once per slot in ``indices``."""
        result = getattr(self, method_name)(*method_args, **method_kwargs)
        return [result] * len(list(self._get_indices(indices)))

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Return False for each slot: none is wrapped separately."""
        return [False] * len(list(self._get_indices(indices)))

    def _get_indices(self, indices: Any) -> Any:
        return range(int(np.prod(self._shape))) if indices is None else np.atleast_1d(indices)
