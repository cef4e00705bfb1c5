r"""What is known about the equilibria with each vector of arrivals.

    low   =  sum_i lam_i T_i + sum_i (1 - lam_i) m(T)       m(T): the least losses
    high  =  sum_i lam_i T_i + sum_i (1 - lam_i) most(T)    most(T): proved for equilibria

Proofs (:mod:`solvers.extremes.arrivals_proof`) narrow this range from both ends, or show that there
are no such equilibria.  After one that does not end within its limits, the next tries half of what
was tried; once that is proved, more again.
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
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.engine.cuts import CutPool
from solvers.engine.presolve import Subproblem
from solvers.engine.symmetry import identity
from solvers.extremes.arrivals_proof import ArrivalsProof
from solvers.extremes.response_limit import ResponseLimits

FIRST_EFFORTS = 30, 3000
"""Rounds of inequalities for the first proof of a vector, and nodes of each program; a proof that
does not end doubles them."""


class ArrivalVector:
    """Bounds on the losses of all equilibria with given arrivals.

    Attributes
    ----------
    least, most : bounds on the losses; ``most`` is -inf if there are no such equilibria.
    failed : number of proofs that did not end.
    """

    def __init__(
        self, game: Game, arrivals: Sequence[int], epsilon: float, responses: ResponseLimits
    ) -> None:
        self.game, self.arrivals, self._epsilon = game, tuple(arrivals), epsilon
        self._responses = responses
        self._time = sum(a.lam * t for a, t in zip(game.agents, arrivals, strict=True))
        self._care = sum(1 - agent.lam for agent in game.agents)
        self.least = 0.0
        self.most = min(arrivals) * float(objective.loss(game, np.zeros(())))
        self.failed, self._share, self._efforts = 0, 0.0, FIRST_EFFORTS
        self._proof: ArrivalsProof | None = None

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
        wanted = max((goal - self._time) / self._care, self.least)
        limit = wanted + self._share * max(self.most - wanted, 0.0)
        if self._excludes(limit, self.most, budget):
            self.most = -inf if limit <= self.least else limit

    def limit(self) -> None:
        """Use what the agents pay at most in response to plans with these arrivals."""
        for i, agent in enumerate(self.game.agents):
            high = self._responses.of(i, self.arrivals[1 - i]).high
            losses = (high - agent.lam * self.arrivals[i]) / (1 - agent.lam)
            self.most = min(self.most, losses)
        if self.most < self.least - tol.AGREEMENT * max(1.0, self.least):
            self.most = -inf

    def dismiss(self, goal: float, budget: Budget) -> None:
        """Lower the costs to ``goal`` if the responses of one agent to all plans show that."""
        self._efforts, efforts = (0, 0), self._efforts
        self.lower(goal, budget)
        self._efforts, self.failed, self._share = efforts, 0, 0.0

    def raise_low(self, goal: float, budget: Budget) -> None:
        """Try to prove that equilibria cost at least ``goal``, or that there are none."""
        wanted = min((goal - self._time) / self._care, self.most)
        limit = wanted - self._share * max(wanted - self.least, 0.0)
        if self._excludes(self.least, limit, budget):
            self.least, self.most = limit, self.most if limit < self.most else -inf

    def _excludes(self, least: float, most: float, budget: Budget) -> bool:
        """Return whether no equilibrium is proved to lose from ``least`` to ``most``."""
        if self._proof is None:
            self._proof = ArrivalsProof(self.game, self.arrivals, self._epsilon, self._responses)
        slack = tol.AGREEMENT * max(1.0, abs(least))
        rounds, nodes = self._efforts
        proved = self._proof.excludes(
            least - slack, most + slack, budget, rounds=rounds, nodes=nodes
        )
        if proved:
            self._share = 0.0 if self._share < 0.2 else self._share / 2
        else:
            self.failed += 1
            self._share, self._efforts = (1 + self._share) / 2, (2 * rounds, 2 * nodes)
        return proved

    def take_candidate(self) -> Profile | None:
        """Return a new profile that may be an equilibrium, if the last proof ended with one."""
        if self._proof is None or self._proof.candidate is None:
            return None
        candidate, self._proof.candidate = self._proof.candidate, None
        return candidate

    @property
    def inequalities(self) -> int:
        """Number of equilibrium inequalities of its proof."""
        return 0 if self._proof is None else self._proof.inequalities


def refinable(game: Game) -> bool:
    """Return whether proofs for vectors of arrivals exist for games like this."""
    pair = len(game.agents) == 2 and not game.obstacles
    instants = game.collisions == "instants" and game.on_goal == "remove"
    effortless = not any(agent.effort for agent in game.agents)
    first = [earliest_way(game, i) for i in range(len(game.agents))]
    return pair and instants and effortless and all(first)


def all_vectors(game: Game, epsilon: float, responses: ResponseLimits) -> list[ArrivalVector]:
    """Return a vector for every pair of arrivals that the agents can reach."""
    ranges = [range(earliest_way(game, i) or 0, game.horizon + 1) for i in (0, 1)]
    return [ArrivalVector(game, arrivals, epsilon, responses) for arrivals in product(*ranges)]
