r"""What an agent pays at most if it responds to any plan of the other with a given arrival.

    V_i(T_j)  =  max over plans x_j that arrive at T_j   min over plans d of i    J_i(d, x_j)

In an epsilon-equilibrium, agent i pays at most V_i(T_j) + epsilon.  That V_i(T_j) is at most a
given cost is proved by adding deviations to a program of hindering plans
(:mod:`solvers.extremes.hindering_plans`) until it has no point.  If its point leaves no deviation
that is cheap enough, that plan and the response to it may be an equilibrium.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from ppg_env.game.earliest_way import earliest_way
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan, Profile
from solvers.budget import Budget
from solvers.equilibrium.best_response import best_response
from solvers.extremes.guard import Guard
from solvers.extremes.guarded_response import guarded_response
from solvers.extremes.hindering_plans import HinderingPlans
from solvers.extremes.rows import Outcome

SHARES = (0.5, 0.25, 0.1, 0.03, 0.0)
"""Parts of what the other agent can reach, around its plan, that deviations are guarded against."""

GAIN = 1e-6
"""Least gain beyond epsilon, in time steps, by which costs are told apart."""

NODES = 1000
"""Nodes of each program."""


class ResponseLimit:
    """Bounds on what agent ``i`` pays in equilibria in which the other arrives at ``arrival``.

    Attributes
    ----------
    low, high : the largest cost whose proof failed, and the least that is proved.
    rounds : the number of programs for one cost.
    deviations : plans of agent ``i`` to begin with; new ones are appended.
    witnesses : pairs of a plan that was found and the response.
    """

    def __init__(
        self, game: Game, i: int, arrival: int, epsilon: float, deviations: list[Plan]
    ) -> None:
        self._game, self._i, self._arrival, self._epsilon = game, i, arrival, epsilon
        self.low, self.high = game.agents[i].lam * (earliest_way(game, i) or 0), inf
        self.rounds, self.deviations = 0, deviations
        self.witnesses: list[Profile] = []

    def shows(self, cost: float, budget: Budget) -> bool:
        """Return whether agent ``i`` is proved to pay at most ``cost`` in these equilibria."""
        if self.low < cost < self.high and not budget.out:
            if self._is_proved(cost, budget):
                self.high = cost
            else:
                self.low = max(self.low, cost)
        return self.high <= cost

    def _is_proved(self, cost: float, budget: Budget) -> bool:
        most = cost - self._epsilon
        program = HinderingPlans(self._game, self._i, self._arrival, most)
        for plan in self.deviations:
            program.add(plan)
        for _ in range(self.rounds):
            outcome, other = program.point(budget, NODES)
            if outcome is not Outcome.POINT or other is None:
                return outcome is Outcome.NONE
            plan = self._excluding(program, other, most, budget)
            if plan is None:
                return False
            self.deviations.append(plan)
        return False

    def _excluding(
        self, program: HinderingPlans, other: Plan, most: float, budget: Budget
    ) -> Plan | None:
        """Return a deviation that excludes ``other`` from the program, which it is added to."""
        for share in SHARES:
            guard = Guard.around(self._game, self._i, other, self._arrival, share)
            plan = guarded_response(guard, most, budget)
            if plan is not None and program.add(plan, guard.losses(plan)):
                return plan
        pair = (other, other)
        solution = best_response(self._game, self._i, pair, time_limit=budget.left)
        if solution.profile is None or solution.evaluation is None:
            return None
        plan = solution.profile[self._i]
        guard = Guard.around(self._game, self._i, other, self._arrival, 0.0)
        if guard.cost(plan) <= most and program.add(plan, guard.losses(plan)):
            return plan
        self.low = max(self.low, float(solution.evaluation.shifted_cost[self._i]))
        self.witnesses.append(solution.profile)
        return None


class ResponseLimits:
    """The limits for both agents and all arrivals of the other, which share their deviations."""

    def __init__(self, game: Game, epsilon: float) -> None:
        self._game, self._epsilon = game, epsilon
        self._deviations: tuple[list[Plan], list[Plan]] = [], []
        self._guesses = [0.0, 0.0]
        self._limits: dict[tuple[int, int], ResponseLimit] = {}

    def of(self, i: int, arrival: int) -> ResponseLimit:
        """Return the limit of agent ``i`` where the other arrives at ``arrival``."""
        if (i, arrival) not in self._limits:
            self._limits[i, arrival] = ResponseLimit(
                self._game, i, arrival, self._epsilon, self._deviations[i]
            )
        return self._limits[i, arrival]

    def tighten(
        self, i: int, arrival: int, own: Sequence[int], rounds: int, budget: Budget
    ) -> None:
        """Show that agent ``i`` pays less than for as many of its ``own`` arrivals as possible."""
        limit, lam = self.of(i, arrival), self._game.agents[i].lam
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
        witnesses = [pair for limit in self._limits.values() for pair in limit.witnesses]
        for limit in self._limits.values():
            limit.witnesses.clear()
        return witnesses
