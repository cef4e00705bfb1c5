r"""Rewards from which learning can start: shaped by the time still needed, and scaled.

    reward' = (reward + Phi' - Phi) / reward_scale

The potential Phi of an agent is -lam times the steps that it still needs on the straight way to
its goal, and 0 once it is out of traffic.  The changes of an episode sum to Phi at its end minus
Phi at its start (Ng et al., 1999), so without discount:

- Where an agent arrives or crashes, its return changes by a constant, lam times the steps of the
  straight way from its start.
- Where its time runs out, Phi keeps its value: the return is lower than that by lam times the
  steps of the straight way that is left.  Policies that always arrive or crash compare as before,
  and staying away from the goal pays less than before.  Were Phi set to 0 there, staying away would
  be paid as if the agent had arrived, and agents would learn to hide.

With a discount gamma that is so for gamma Phi' - Phi only.  Here the difference has no gamma: it is
exact for gamma = 1, as in ``ppg train``.  With gamma = 0.99, as in the examples of other libraries,
it is a heuristic, which in addition charges 1 - gamma of the cost of the way that is left per step.

With ``sharing="social"`` every agent that acts gets the sum of all agents' changes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env.env.simulator import Simulator
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.game.reachability import earliest_arrival
from ppg_env.support.validation import finite_number


class RewardShaping:
    """Shapes and scales the rewards of a simulator, step by step.

    Parameters
    ----------
    simulator
        Its copies are stepped between :meth:`before_step` and :meth:`rewards`.
    shaping
        Whether rewards are shaped.
    reward_scale
        Rewards are divided by it.

    Raises
    ------
    InputError
        If ``shaping`` is no truth value, or ``reward_scale`` no positive number.
    """

    def __init__(self, simulator: Simulator, shaping: Any, reward_scale: Any) -> None:
        truth = isinstance(shaping, (bool, np.bool_))
        require(truth, "shaping", f"is {shaping!r:.60}", "write True or False")
        remedy = "give a positive number"
        self._scale = finite_number(reward_scale, "reward_scale", remedy)
        require(self._scale > 0, "reward_scale", f"is {reward_scale!r:.60}", remedy)
        self._simulator = simulator
        self._pace = straight_pace(simulator.game, simulator.tables.scale) if shaping else None
        self._rate = self._before = np.zeros(simulator.status.shape)

    def before_step(self) -> None:
        """Note the potentials before a step."""
        if self._pace is not None:
            self._rate = -self._simulator.lam * self._pace
            self._before = self._potential(self._simulator.last.observation)

    def rewards(self, observation: np.ndarray) -> np.ndarray:
        """Return the rewards (C, N) of the last step, after which agents observe (C, N, W).

        Copies that the step has restarted are given by their final observations.
        """
        out = self._simulator.last
        if self._pace is None:
            return out.reward / self._scale
        change = self._potential(observation) - self._before
        if self._simulator.rules.sharing == "social":
            change = np.where(out.acting, change.sum(axis=1, keepdims=True), 0.0)
        return (out.reward + change) / self._scale

    def _potential(self, observation: np.ndarray) -> np.ndarray:
        """Return (C, N) minus the cost of the steps left on the straight way to the goal."""
        d, n = self._simulator.game.dim, self._simulator.state.shape[2]
        away = np.linalg.norm(observation[:, :, :d], axis=2)
        potential: np.ndarray = self._rate * away * observation[:, :, n + d]
        return potential


def straight_pace(game: Game, scale: float) -> np.ndarray:
    """Return (N,) steps per unit of observed distance on the straight way."""
    pace = np.zeros(len(game.agents))
    for i, agent in enumerate(game.agents):
        d = agent.dim
        length = float(np.linalg.norm(agent.goal[:d] - agent.start[:d])) / scale
        steps = earliest_arrival(agent, game.horizon)
        pace[i] = 0.0 if length == 0 else (steps or game.horizon) / length
    return pace
