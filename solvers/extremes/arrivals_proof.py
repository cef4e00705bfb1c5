r"""Proofs that every equilibrium with given arrivals has small losses, or that there is none.

In an epsilon-equilibrium x with arrivals T, every deviation x'_i satisfies

    lam_i T_i + (1 - lam_i) L(x)  <=  J_i(x'_i, x_-i) + epsilon.

So if each profile of a node leaves one of the agents a deviation that costs at most

    c_i  =  lam_i T_i + (1 - lam_i) most - epsilon,

then L <= ``most`` in all equilibria of the node; if ``most`` is below the least loss that the
arrivals allow, there are none.  A node is a set of plans of each agent.  It is closed by a
deviation that is cheap against the whole set of the other agent (a guarded response).  Otherwise a
deviation that is cheap near the centre of that set divides it: the plans that hinder the deviation
are covered by one subset for each time at which they may do so (:mod:`solvers.extremes.hindrance`).
Where even the centres hinder each other, a set is bisected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game import objective
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan
from solvers.budget import Budget
from solvers.extremes.guard import Guard, directions_of
from solvers.extremes.guarded_response import guarded_response
from solvers.extremes.hindrance import hindrances
from solvers.extremes.joint_losses import LeastLosses, least_losses
from solvers.extremes.plan_set import HalfSpace, PlanSet

SHARES = (0.7, 0.4, 0.0)
"""Parts of a set, around its centre, against which dividing deviations are looked for in turn."""


@dataclass(frozen=True)
class _Node:
    """Sets of plans of both agents, and the agents whose guarded response is not known to fail."""

    sets: tuple[PlanSet, PlanSet]
    losses: float
    untried: tuple[int, ...] = (0, 1)

    def with_set(self, j: int, subset: PlanSet) -> _Node:
        """Return the node with another set of agent ``j``."""
        pair = (subset, self.sets[1]) if j == 0 else (self.sets[0], subset)
        return _Node(pair, self.losses, (1 - j,))


class ArrivalsProof:
    """The search for one vector of arrivals, which can be continued.

    Parameters
    ----------
    most : the losses that equilibria are to be shown not to exceed.
    epsilon : the gain that an equilibrium leaves to each agent.
    """

    def __init__(
        self, game: Game, arrivals: Sequence[int], most: float, epsilon: float
    ) -> None:
        self._game, self._most, self._epsilon = game, most, epsilon
        first, second = (
            PlanSet(agent, game.horizon, arrivals[j], directions_of(game, j))
            for j, agent in enumerate(game.agents)
        )
        # Bodies that touch at each event in traffic lose the most.
        worst = min(arrivals) * float(objective.loss(game, np.zeros(())))
        self._open = [_Node((first, second), worst)]
        self.nodes = 0
        self.stuck: list[tuple[Plan, Plan]] = []

    @property
    def closed(self) -> bool:
        """Whether the proof is complete."""
        return not self._open

    def search(self, budget: Budget, nodes: int) -> bool:
        """Continue for a number of nodes; return whether the proof is complete."""
        last = self.nodes + nodes
        while self._open and self.nodes < last and not budget.out:
            self.nodes += 1
            node = self._open.pop()
            if any(plans.empty for plans in node.sets):
                continue
            losses = min([node.losses, *(self._losses(node, i, budget) for i in node.untried)])
            if losses <= self._most:
                continue
            above = losses + tol.AGREEMENT * max(1.0, losses)
            least = least_losses(self._game, node.sets, above, budget)
            if least.bound < above:
                self._open += self._divided(replace(node, losses=losses), least, budget)
        return self.closed

    def _losses(self, node: _Node, i: int, budget: Budget) -> float:
        """Return an upper bound on the losses, by a deviation of agent ``i`` from the node."""
        agent, arrival = self._game.agents[i], node.sets[i].arrival
        guard = Guard.against(self._game, node.sets[1 - i])
        care, spent = 1 - agent.lam, agent.lam * arrival - self._epsilon
        plan = guarded_response(guard, spent + care * node.losses, budget)
        return np.inf if plan is None else (guard.cost(plan) - spent) / care

    def _divided(self, node: _Node, least: LeastLosses, budget: Budget) -> list[_Node]:
        """Return nodes that cover the equilibria of a node."""
        for plans in ([each.centre for each in node.sets], least.plans):
            choices = []
            for i in (0, 1):
                around = None if plans is None else plans[1 - i]
                if around is not None:
                    choices.append((1 - i, self._hindering(node.sets, i, around, least, budget)))
            found = [(j, parts) for j, parts in choices if parts is not None]
            if found:
                j, parts = min(found, key=lambda choice: len(choice[1]))
                return [node.with_set(j, node.sets[j].with_half_spaces(part)) for part in parts]
        return self._bisected(node)

    def _hindering(
        self,
        sets: tuple[PlanSet, PlanSet],
        i: int,
        around: Plan,
        least: LeastLosses,
        budget: Budget,
    ) -> list[tuple[HalfSpace, ...]] | None:
        """Return half-spaces that cover where agent ``i`` has no cheap deviation.

        Cheap ones leave losses below ``most``, or below all losses of the node.
        """
        others, agent = sets[1 - i], self._game.agents[i]
        losses = max(self._most, least.bound - tol.AGREEMENT)
        cost = agent.lam * sets[i].arrival + (1 - agent.lam) * losses - self._epsilon
        whole = Guard.against(self._game, others)
        for share in SHARES:
            guard = Guard.against(self._game, others, share, around)
            plan = guarded_response(guard, cost, budget)
            if plan is not None:
                return hindrances(whole, plan, (cost - whole.time_cost(plan)) / (1 - agent.lam))
        return None

    def _bisected(self, node: _Node) -> list[_Node]:
        """Return two nodes, with the widest set divided across its largest extent."""
        centres = [plans.centre for plans in node.sets]
        if centres[0] is not None and centres[1] is not None:
            self.stuck.append((centres[0], centres[1]))
        width, j, t, axis, middle = max(_widest(plans, j) for j, plans in enumerate(node.sets))
        normal = np.eye(self._game.dim)[axis]
        halves = [
            HalfSpace(t, tuple((sign * normal).tolist()), sign * middle) for sign in (1.0, -1.0)
        ]
        return [node.with_set(j, node.sets[j].with_half_spaces([half])) for half in halves]


def _widest(plans: PlanSet, j: int) -> tuple[float, int, int, int, float]:
    """Return the largest extent of a set's positions, with agent, time, axis and middle."""
    positions = np.array([plan.means[: plans.arrival, : plans.agent.dim] for plan in plans.vertices])
    low, high = positions.min(axis=0), positions.max(axis=0)
    t, axis = np.unravel_index((high - low).argmax(), low.shape)
    middle = float(low[t, axis] + high[t, axis]) / 2
    return float((high - low)[t, axis]), j, int(t), int(axis), middle
