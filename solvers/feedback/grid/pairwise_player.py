"""Players of three and more agents that look one step ahead on the costs of their pairs.

An action u_i of agent i in traffic with k others costs

    sum_j Q_ij(x_i, x_j, u_i, u_j) - (k - 1) Q_i(x_i, u_i)

with Q_ij the expected cost to go of the pair, or of i in it, and Q_i that of i alone.  The agents
choose in turn, first from their sets of actions, then with smaller steps around the best.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from ppg_env.env.players import Player, View
from ppg_env.game.game import Game
from ppg_env.game.input_sets import set_at
from ppg_env.game.polytope import Polytope
from solvers.feedback.grid.action_costs import ActionCosts
from solvers.feedback.grid.decisions import SWEEPS
from solvers.feedback.grid.look_ahead import REFINEMENTS
from solvers.feedback.grid.moves import action_spacing
from solvers.feedback.grid.player import Policy


@dataclass(frozen=True)
class Scene:
    """C copies at one time: states (C, N, n), agents in traffic (C, N)."""

    clock: int
    states: np.ndarray
    traffic: np.ndarray

    def equals(self, other: Scene) -> bool:
        """Return whether all states are the same."""
        return (
            self.clock == other.clock
            and np.array_equal(self.traffic, other.traffic)
            and np.array_equal(self.states, other.states, equal_nan=True)
        )


class JointDecisions:
    """Decides for all agents at once, on the policies of the pairs (i, j) of agents i < j."""

    def __init__(self, game: Game, policies: dict[tuple[int, int], Policy]) -> None:
        self.game, self._policies = game, policies
        self._costs = {pair: ActionCosts(policy) for pair, policy in policies.items()}
        self._latest: tuple[Scene, np.ndarray] | None = None

    def players(self) -> list[Player]:
        """Return one player per agent."""
        return [PairwisePlayer(self, i) for i in range(len(self.game.agents))]

    def actions(self, scene: Scene) -> np.ndarray:
        """Return actions (C, N, m); those of agents out of traffic are zero."""
        if self._latest is None or not self._latest[0].equals(scene):
            self._latest = scene, self._decide(scene)
        return self._latest[1]

    def _decide(self, scene: Scene) -> np.ndarray:
        agents = range(len(self.game.agents))
        actions = np.zeros((*scene.traffic.shape, max(a.control_dim for a in self.game.agents)))
        tried = [self._action_set(i, scene.clock) for i in agents]
        for i in agents:
            only = Scene(scene.clock, scene.states, scene.traffic & (np.arange(len(agents)) == i))
            self._choose(i, tried[i][None], only, actions)
        for _ in range(SWEEPS):
            before = actions.copy()
            for i in agents:
                self._choose(i, tried[i][None], scene, actions)
            if np.array_equal(before, actions):
                break
        for level in range(REFINEMENTS):
            for i in agents:
                control = set_at(self.game.agents[i].control, scene.clock)
                steps = action_spacing(tried[i], control) * 0.5 ** (level + 1)
                shifts = np.array(list(product((0.0, -1.0, 1.0), repeat=steps.size))) * steps
                around = within(control, actions[:, i, None, : steps.size], shifts)
                self._choose(i, around, scene, actions)
        return actions

    def _choose(self, agent: int, tried: np.ndarray, scene: Scene, actions: np.ndarray) -> None:
        """Write the cheapest of the actions ``tried`` (C or 1, K, m) of ``agent``."""
        now = np.flatnonzero(scene.traffic[:, agent])
        every = np.broadcast_to(tried, (len(actions), *tried.shape[1:]))[now]
        best = np.argmin(self._total(agent, every, scene, now, actions), axis=1)
        actions[now, agent, : tried.shape[2]] = every[np.arange(now.size), best]

    def _total(
        self, agent: int, tried: np.ndarray, scene: Scene, now: np.ndarray, actions: np.ndarray
    ) -> np.ndarray:
        """Return the costs (R, K) of ``tried`` (R, K, m) in the copies ``now`` (R,)."""
        total, met = np.zeros(tried.shape[:2]), np.zeros(now.size)
        for other in range(len(self.game.agents)):
            rows = np.flatnonzero(scene.traffic[now, other])
            if other == agent or not rows.size:
                continue
            pair, at = (min(agent, other), max(agent, other)), now[rows]
            total[rows] += self._costs[pair].together(
                int(agent > other), scene.states[at][:, pair], scene.clock, tried[rows],
                actions[at, other, : self.game.agents[other].control_dim],
            )  # fmt: skip
            met[rows] += 1
        rows = np.flatnonzero(met != 1)
        if rows.size:
            pair = self._any_pair(agent)
            alone = self._costs[pair].alone(
                pair.index(agent), scene.states[now[rows]][:, pair], scene.clock, tried[rows]
            )
            total[rows] -= (met[rows, None] - 1) * alone
        return total

    def _any_pair(self, agent: int) -> tuple[int, int]:
        return next(pair for pair in self._policies if agent in pair)

    def _action_set(self, agent: int, clock: int) -> np.ndarray:
        """Return the actions (K, m) that ``agent`` tries first."""
        pair = self._any_pair(agent)
        return self._policies[pair].body(pair.index(agent), clock).actions


def within(control: Polytope, middle: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """Return ``middle`` (C, 1, m) and ``shifts`` (K, m) from it, cut at the border of the set."""
    along = shifts @ control.normals.T
    left = np.maximum(control.offsets - middle @ control.normals.T, 0.0)
    room = np.where(along > 1e-12, left / np.maximum(along, 1e-12), 1.0).min(axis=2)
    return middle + np.minimum(room, 1.0)[..., None] * shifts


class PairwisePlayer:
    """Plays one agent's part in :class:`JointDecisions`."""

    information = "full state"

    def __init__(self, decisions: JointDecisions, agent: int) -> None:
        self._decisions, self._agent = decisions, agent
        self._inputs = decisions.game.agents[agent].control_dim

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m)."""
        action = np.zeros((len(view.clock), self._inputs))
        for clock in np.unique(view.clock).tolist():
            rows = np.flatnonzero(view.clock == clock)
            scene = Scene(clock, view.state[rows], view.in_traffic[rows])
            action[rows] = self._decisions.actions(scene)[:, self._agent, : self._inputs]
        return action
