r"""Descent on expected costs: what a network that imitates feedback players loses at each step.

    minimise  mean sum_k p_k(x) Q_i(x, a_k(x), u)    over states x that the network visits

a_k are the actions of the experts, p is the softmax of their gates, and u is the action of the
other agent, of an expert drawn likewise.  Q_i(x, a, u) is the expected cost to go of agent i, or
of all agents for the feedback optimum, if the agents take these actions in state x and the
feedback players play afterwards.  By how much the network costs more than these is the sum of
Q_i - min Q_i over the steps of its episodes (the performance difference lemma of Kakade and
Langford, 2002).  Imitation weighs all differences between actions alike; costs weigh them by what
they lose.

Gates have exact gradients.  Those of actions are central differences of look-ahead costs on the
grid, with random widths, for one expert that is drawn: no episode has to be played to its end.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from baselines.export import actor_layers, candidates
from baselines.imitation import Demonstration, Disturbance
from baselines.training_loop import Activity, silent
from ppg_env.env.players import Player
from solvers.feedback.grid.action_costs import ActionCosts
from solvers.feedback.grid.player import FeedbackPlayer

UPDATES, RATE = 5000, 3e-3
"""Updates, one per step of all copies, and the learning rate, which decreases to zero."""

WIDTH = 0.1
"""Typical width of the differences, in units of the largest control."""

PUSH = 0.3
"""Standard deviation of the disturbances, in units of the largest control."""

OUTSIDE, EDGE = 0.01, 1.2
"""Weight of the squared distance by which actions leave the box [-EDGE, EDGE]."""

LARGEST = 1.0
"""Largest norm of a gradient.  Bounding the slopes of single states makes crashes more likely."""

REPORTED = 50
"""Updates between two reports of what the training does."""


def descend(
    model: Any,
    demonstrations: Sequence[Demonstration],
    random: np.random.Generator,
    activity: Activity = silent,
) -> None:
    """Lower the expected costs of the mean policy of ``model``.

    In games of a single agent, and where arrived bodies stay, the network is left as it is: the
    grid does not give the costs of all states.
    """
    if not all(_has_costs(demonstration) for demonstration in demonstrations):
        return
    parameters = [value for layer in actor_layers(model) for value in layer.parameters()]
    optimiser = torch.optim.Adam(parameters, lr=RATE)
    plays = [_Play(demonstration, random) for demonstration in demonstrations]
    for k in range(UPDATES):
        if k % REPORTED == 0:
            activity(f"descending on expected costs, update {k} of {UPDATES}")
        optimiser.param_groups[0]["lr"] = RATE * (1 - k / UPDATES)
        loss = torch.stack([play.step(model) for play in plays]).mean()
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(parameters, LARGEST)
        optimiser.step()


def _has_costs(demonstration: Demonstration) -> bool:
    player = demonstration.players[0]
    return isinstance(player, FeedbackPlayer) and not player.policy.model.risk.parks


class _Play:
    """Copies of the game in which the network plays, with disturbances."""

    def __init__(self, demonstration: Demonstration, random: np.random.Generator) -> None:
        self._env, players = demonstration
        self._costs = [ActionCosts(player.policy) for player in players]  # type: ignore[attr-defined]
        self._random = random
        self._disturbance = Disturbance(self._env, PUSH, random)
        self._observation: Any = self._env.reset()

    def step(self, model: Any) -> torch.Tensor:
        """Return a loss with the gradient of the mean cost, and step all copies."""
        env = self._env
        gates, actions = candidates(model, torch.as_tensor(self._observation))
        chances = torch.softmax(gates, dim=1)
        shape = (env.simulator.copies, len(env.learners), *actions.shape[1:])
        proposed = np.clip(actions.detach().numpy().astype(float), -1.0, 1.0).reshape(shape)
        drawn = self._drawn(chances.detach().numpy()).reshape(shape[:2])
        costs, slopes = self._costs_and_slopes(proposed, drawn)
        active = max(int(env.simulator.view(0).in_traffic[:, env.learners].sum()), 1)
        played = gates.detach().numpy().argmax(axis=1).reshape(shape[:2])
        self._observation = env.step(self._disturbance.of(_of_experts(proposed, played)))[0]
        beyond = actions - actions.clamp(-EDGE, EDGE)
        loss = (chances * _like(costs, chances)).sum() + OUTSIDE * (beyond**2).sum()
        drawn_actions = actions[torch.arange(len(actions)), torch.as_tensor(drawn.ravel())]
        return (loss + (_like(slopes, drawn_actions) * drawn_actions).sum()) / active

    def _drawn(self, chances: np.ndarray) -> np.ndarray:
        """Return one expert (C L,) for each learner."""
        below = chances.cumsum(axis=1) < self._random.random((len(chances), 1))
        drawn: np.ndarray = np.minimum(below.sum(axis=1), chances.shape[1] - 1)
        return drawn

    def _costs_and_slopes(
        self, proposed: np.ndarray, drawn: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the costs (C, L, K) of ``proposed`` actions (C, L, K, m), less the least of them.

        The derivatives (C, L, m) are those at the ``drawn`` experts (C, L), which the other agent
        takes as well; all are zero out of traffic.
        """
        env, action = self._env, _of_experts(proposed, drawn)
        costs, slopes = np.zeros(proposed.shape[:3]), np.zeros(action.shape)
        agents, simulator = env.simulator.game.agents, env.simulator
        inputs = [player.act(simulator.view(i)) for i, player in self._others()]
        for k, i in enumerate(env.learners):
            inputs.insert(i, env.inputs(i, action[:, k, : agents[i].control_dim]))
        width = WIDTH * np.exp(self._random.uniform(-1.0, 1.0))
        for k, i in enumerate(env.learners):
            size = agents[i].control_dim
            shifts = width * np.concatenate([np.eye(size), -np.eye(size)])
            tried = [action[:, k, None, :size] + shifts, proposed[:, k, :, :size]]
            found = self._costs_of(i, env.inputs(i, np.concatenate(tried, axis=1)), inputs[1 - i])
            slopes[:, k, :size] = (found[:, :size] - found[:, size : 2 * size]) / (2 * width)
            costs[:, k] = found[:, 2 * size :] - found[:, 2 * size :].min(axis=1, keepdims=True)
        return costs, slopes

    def _others(self) -> list[tuple[int, Player]]:
        """Return the agents that do not learn."""
        return sorted(self._env.players.items())

    def _costs_of(self, agent: int, actions: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Return the costs (C, K) of ``actions`` (C, K, m), zero out of traffic."""
        view, costs = self._env.simulator.view(agent), self._costs[agent]
        own, far = view.in_traffic[:, agent], view.in_traffic[:, 1 - agent]
        stages = {clock: costs.stage(clock) for clock in np.unique(view.clock).tolist()}
        result = np.zeros(actions.shape[:2])
        for stage in set(stages.values()):
            clocks = [clock for clock, its in stages.items() if its == stage]
            now = own & np.isin(view.clock, clocks)
            both, alone = np.flatnonzero(now & far), np.flatnonzero(now & ~far)
            if both.size:
                result[both] = costs.together(
                    agent, view.state[both], clocks[0], actions[both], other[both]
                )
            if alone.size:
                result[alone] = costs.alone(agent, view.state[alone], clocks[0], actions[alone])
        return result


def _of_experts(proposed: np.ndarray, experts: np.ndarray) -> np.ndarray:
    """Return the actions (C, L, m) of ``experts`` (C, L) among ``proposed`` (C, L, K, m)."""
    return np.take_along_axis(proposed, experts[:, :, None, None], axis=2)[:, :, 0]


def _like(array: np.ndarray, tensor: torch.Tensor) -> torch.Tensor:
    """Return ``array`` in the shape and type of ``tensor``."""
    return torch.as_tensor(array.reshape(tensor.shape).astype(np.float32))
