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
from dataclasses import dataclass

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.plan import Plan
from solvers.budget import Budget
from solvers.extremes.guard import Guard, directions_of
from solvers.extremes.guarded_response import guarded_response
from solvers.extremes.hindrance import hindrances
from solvers.extremes.plan_set import HalfSpace, PlanSet

SHARES = (0.7, 0.4, 0.0)
"""Parts of a set, around its centre, against which dividing deviations are looked for in turn."""


@dataclass(frozen=True)
class _Node:
    """Sets of plans of both agents, and the agents whose guarded response is not known to fail."""

    sets: tuple[PlanSet, PlanSet]
    untried: tuple[int, ...] = (0, 1)

    def with_set(self, j: int, subset: PlanSet) -> _Node:
        """Return the node with another set of agent ``j``."""
        pair = (subset, self.sets[1]) if j == 0 else (self.sets[0], subset)
        return _Node(pair, (1 - j,))


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
        self._game = game
        agents = zip(game.agents, arrivals, strict=True)
        self._costs = [a.lam * t + (1 - a.lam) * most - epsilon for a, t in agents]
        first, second = (
            PlanSet(agent, game.horizon, arrivals[j], directions_of(game, j))
            for j, agent in enumerate(game.agents)
        )
        self._open = [_Node((first, second))]
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
            if not any(self._deviates(node.sets[1 - i], i, budget) for i in node.untried):
                self._open += self._divided(node, budget)
        return self.closed

    def _deviates(self, others: PlanSet, i: int, budget: Budget) -> bool:
        guard = Guard.against(self._game, others)
        return guarded_response(guard, self._costs[i], budget) is not None

    def _divided(self, node: _Node, budget: Budget) -> list[_Node]:
        """Return nodes that cover the equilibria of a node."""
        best: list[_Node] | None = None
        for i in (0, 1):
            j = 1 - i
            parts = self._hindering(node.sets[j], i, budget)
            if parts is not None and (best is None or len(parts) < len(best)):
                best = [node.with_set(j, node.sets[j].with_half_spaces(part)) for part in parts]
        return self._bisected(node) if best is None else best

    def _hindering(
        self, others: PlanSet, i: int, budget: Budget
    ) -> list[tuple[HalfSpace, ...]] | None:
        """Return half-spaces that cover where ``others`` leave agent ``i`` no cheap deviation."""
        whole = Guard.against(self._game, others)
        for share in SHARES:
            guard = Guard.against(self._game, others, share)
            plan = guarded_response(guard, self._costs[i], budget)
            if plan is not None:
                room = self._costs[i] - whole.time_cost(plan)
                return hindrances(whole, plan, room / (1 - self._game.agents[i].lam))
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
