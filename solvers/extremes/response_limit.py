r"""What an agent pays at most if it responds to any plan of the other with a given arrival.

    V_i(T_j)  =  max over plans x_j that arrive at T_j   min over plans d of i    J_i(d, x_j)

In an epsilon-equilibrium, agent i pays at most V_i(T_j) + epsilon.  That V_i(T_j) is at most a
given cost is proved by deviations (:mod:`solvers.extremes.hindrance_proof`).  Where that fails, a
plan that hinders all of them and the response to it may be an equilibrium.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from ppg_env.game.game import Game
from ppg_env.game.plan import Plan, Profile
from solvers.budget import Budget
from solvers.extremes.hindering_plans import HinderingPlans
from solvers.extremes.hindrance_proof import HindranceProof

GAIN = 1e-6
"""Least gain beyond epsilon, in time steps, by which costs are distinguished."""

NODES = 1000
"""Nodes of each program."""


class ResponseLimit:
    """Bounds on what an agent pays in equilibria in which the other arrives at a given time.

    Attributes
    ----------
    low, high : the largest cost whose proof failed, and the least that is proved.
    rounds : the number of programs for one cost.
    """

    def __init__(self, responses: ResponseLimits, i: int, arrival: int) -> None:
        self._responses, self._i, self._arrival = responses, i, arrival
        self.low, self.high, self.rounds = 0.0, inf, 0

    def shows(self, cost: float, budget: Budget) -> bool:
        """Return whether the agent is proved to pay at most ``cost`` in these equilibria."""
        if self.low < cost < self.high and not budget.out:
            if self._responses.proves(self._i, self._arrival, cost, self.rounds, budget):
                self.high = cost
            else:
                self.low = cost
        return self.high <= cost


class ResponseLimits:
    """The limits for both agents and all arrivals of the other, which share their deviations.

    Attributes
    ----------
    witnesses : pairs of plans that may be equilibria.
    """

    def __init__(self, game: Game, epsilon: float) -> None:
        self.game, self._epsilon = game, epsilon
        self._deviations: tuple[list[Plan], list[Plan]] = [], []
        self._guesses = [0.0, 0.0]
        self._limits: dict[tuple[int, int], ResponseLimit] = {}
        self.witnesses: list[Profile] = []

    def of(self, i: int, arrival: int) -> ResponseLimit:
        """Return the limit of agent ``i`` where the other arrives at ``arrival``."""
        return self._limits.setdefault((i, arrival), ResponseLimit(self, i, arrival))

    def proves(self, i: int, arrival: int, cost: float, rounds: int, budget: Budget) -> bool:
        """Return whether agent ``i`` is proved to pay at most ``cost``; keep the witness if not."""
        most = cost - self._epsilon - GAIN
        program = HinderingPlans(self.game, i, arrival, most)
        proof = HindranceProof(program, self._deviations[i])
        complete = proof.search(rounds, NODES, budget)
        if proof.witness is not None:
            self.witnesses.append(proof.witness)
        return complete

    def tighten(
        self, i: int, arrival: int, own: Sequence[int], rounds: int, budget: Budget
    ) -> None:
        """Show that agent ``i`` pays less than for as many of its ``own`` arrivals as possible."""
        limit, lam = self.of(i, arrival), self.game.agents[i].lam
        limit.low, limit.rounds = 0.0, rounds
        costs = sorted({lam * time - GAIN for time in own})
        above = [cost for cost in costs if cost >= self._guesses[i]] or costs[-1:]
        below = [cost for cost in costs if cost < above[0]]
        if not any(limit.shows(cost, budget) for cost in above):
            return
        while below and limit.shows(below[-1], budget):
            below.pop()
        self._guesses[i] = limit.high

    def take_witnesses(self) -> list[Profile]:
        """Return the witnesses that were found since the last call."""
        witnesses, self.witnesses = self.witnesses, []
        return witnesses
