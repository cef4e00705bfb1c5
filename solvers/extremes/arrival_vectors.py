r"""What is known about the equilibria with each vector of arrivals.

    low   =  sum_i lam_i T_i + sum_i (1 - lam_i) m(T)       m(T): the least losses
    high  =  sum_i lam_i T_i + sum_i (1 - lam_i) most(T)    most(T): proved for equilibria

A proof (:mod:`solvers.extremes.arrivals_proof`) lowers ``most``, and refutes a vector if it falls
below m(T).  One that does not end within its nodes is set a higher goal, half-way to what is known,
and once that is proved, a lower one again.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import inf

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game import objective
from ppg_env.game.earliest_way import earliest_way
from ppg_env.game.game import Game
from solvers.budget import Budget
from solvers.engine.cuts import CutPool
from solvers.engine.presolve import Subproblem
from solvers.engine.symmetry import identity
from solvers.extremes.arrivals_proof import ArrivalsProof

FIRST_NODES = 30
"""Nodes for the first proof of a vector; each that does not end doubles them."""


class ArrivalVector:
    """Bounds on the losses of all equilibria with given arrivals.

    Attributes
    ----------
    least, most : bounds on the losses; ``most`` is -inf if there are no such equilibria.
    failed : number of proofs that did not end.
    """

    def __init__(self, game: Game, arrivals: Sequence[int], epsilon: float) -> None:
        self.game, self.arrivals, self._epsilon = game, tuple(arrivals), epsilon
        self._time = sum(a.lam * t for a, t in zip(game.agents, arrivals, strict=True))
        self._care = sum(1 - agent.lam for agent in game.agents)
        self.least = 0.0
        self.most = min(arrivals) * float(objective.loss(game, np.zeros(())))
        self.failed = self.nodes = 0
        self._goal_share, self._allowed = 0.0, FIRST_NODES
        self._proof: tuple[float, ArrivalsProof] | None = None

    @property
    def low(self) -> float:
        """Lower bound on the social cost of such equilibria; infinite if there are none."""
        return inf if self.most == -inf else self._time + self._care * self.least

    @property
    def high(self) -> float:
        """Upper bound on the social cost of such equilibria; -inf if there are none."""
        return self._time + self._care * self.most

    def find_least(self, budget: Budget) -> None:
        """Compute the least losses that the arrivals allow."""
        nothing = np.zeros(2)
        losses = objective.Objective(self.game, nothing, np.ones(1), nothing)
        pool = CutPool(Subproblem(losses, (0, 1), {}), [identity(self.game)], budget)
        least = pool.value((0,), dict(enumerate(self.arrivals)))
        if least == inf:
            self.most = -inf
        else:
            self.least = max(least, 0.0)

    def lower(self, goal: float, budget: Budget) -> None:
        """Try to prove that equilibria cost at most ``goal``, or that there are none."""
        wanted = max((goal - self._time) / self._care, self._refuting)
        most = wanted + self._goal_share * max(self.most - wanted, 0.0)
        if self._attempt(most, budget):
            self.most = -inf if most < self.least else most
            self._goal_share /= 2 if self._goal_share > 0.1 else inf
        else:
            self._goal_share = (1 + self._goal_share) / 2

    def refute(self, budget: Budget) -> None:
        """Try to prove that there are no equilibria."""
        if self._attempt(self._refuting, budget):
            self.most = -inf

    @property
    def _refuting(self) -> float:
        return self.least - tol.AGREEMENT * max(1.0, self.least)

    def _attempt(self, most: float, budget: Budget) -> bool:
        """Continue the proof of ``most``, or begin it; return whether it is complete."""
        if self._proof is None or self._proof[0] != most:
            self._proof = most, ArrivalsProof(self.game, self.arrivals, most, self._epsilon)
        proof, before = self._proof[1], self._proof[1].nodes
        proof.search(budget, self._allowed)
        self.nodes += proof.nodes - before
        if not proof.closed:
            self.failed += 1
            self._allowed *= 2
        return proof.closed


def refinable(game: Game) -> bool:
    """Return whether proofs for vectors of arrivals exist for games like this."""
    pair = len(game.agents) == 2 and not game.obstacles
    instants = game.collisions == "instants" and game.on_goal == "remove"
    effortless = not any(agent.effort for agent in game.agents)
    first = [earliest_way(game, i) for i in range(len(game.agents))]
    return pair and instants and effortless and all(first)


def all_vectors(game: Game, epsilon: float) -> list[ArrivalVector]:
    """Return a vector for every pair of arrivals that the agents can reach."""
    ranges = [range(earliest_way(game, i) or 0, game.horizon + 1) for i in (0, 1)]
    return [ArrivalVector(game, arrivals, epsilon) for arrivals in product(*ranges)]
