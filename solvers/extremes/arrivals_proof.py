r"""Proofs that no equilibrium with given arrivals has losses within given limits.

Equilibrium inequalities are added lazily: the program (:mod:`solvers.extremes.pair_program`)
returns some profile that satisfies those so far.  If an agent gains by a deviation from it, the
inequality of that deviation is added; the proof is complete when no profile is left.
A deviation excludes most if it stays cheap while the other agent moves a little.  So agents respond
to a guard around its plan, if that leaves a deviation (:mod:`solvers.extremes.guarded_response`).
"""

from __future__ import annotations

from collections.abc import Sequence

from ppg_env.game.game import Game
from ppg_env.game.plan import Plan
from solvers.budget import Budget
from solvers.extremes.guard import Guard
from solvers.extremes.guarded_response import guarded_response
from solvers.extremes.pair_program import PairProgram
from solvers.extremes.response_limit import GAIN, ResponseLimits
from solvers.extremes.rows import Outcome

SHARES = (0.5, 0.25, 0.1, 0.03, 0.0)
"""Parts of what the other agent can reach, around its plan, that deviations are guarded against."""


class ArrivalsProof:
    """Equilibrium inequalities for one vector of arrivals.

    Attributes
    ----------
    inequalities : their number.
    candidate : the last profile from which no new deviation was found, if there is one.
    """

    def __init__(
        self,
        game: Game,
        arrivals: Sequence[int],
        epsilon: float,
        responses: ResponseLimits,
    ) -> None:
        self._game, self._arrivals, self._epsilon = game, tuple(arrivals), epsilon
        self._responses = responses
        self._program = PairProgram(game, arrivals, epsilon)
        self._known: set[tuple[int, bytes]] = set()
        self.inequalities = 0
        self.candidate: tuple[Plan, ...] | None = None

    def excludes(
        self, least: float, most: float, budget: Budget, *, rounds: int, nodes: int
    ) -> bool:
        """Return whether no epsilon-equilibrium is proved to lose from ``least`` to ``most``.

        ``rounds`` and ``nodes`` limit the programs, and the nodes of each.
        """
        if self._is_limited(least, budget):
            return True
        for _ in range(rounds):
            if budget.out:
                return False
            outcome, plans, losses = self._program.profile(least, most, budget, nodes)
            if outcome is not Outcome.POINT:
                return outcome is Outcome.NONE
            deviations = [(i, self._deviation(i, plans, losses, budget)) for i in (0, 1)]
            for i, deviation in deviations:
                self._add(i, deviation)
            if not any(deviation for _, deviation in deviations):
                self.candidate = plans
                return False
        return False

    def _is_limited(self, losses: float, budget: Budget) -> bool:
        """Return whether some agent is proved to pay less than for ``losses``."""
        return any(
            self._responses.of(i, self._arrivals[1 - i]).shows(
                agent.lam * self._arrivals[i] + (1 - agent.lam) * losses - GAIN, budget
            )
            for i, agent in enumerate(self._game.agents)
        )

    def _add(self, i: int, deviation: Plan | None) -> None:
        """Add the inequality of a deviation, if there is one."""
        if deviation is not None:
            self._program.add_deviation(i, deviation)
            self._known.add((i, deviation.controls.tobytes()))
            self.inequalities += 1

    def _deviation(
        self, i: int, plans: Sequence[Plan], losses: float, budget: Budget
    ) -> Plan | None:
        """Return a new plan by which agent ``i`` gains more than epsilon, if one is found.

        Known ones do not exclude profiles in which bodies touch: closed rows count that as overlap.
        """
        agent, arrival = self._game.agents[i], self._arrivals[i]
        cost = agent.lam * arrival + (1 - agent.lam) * losses - self._epsilon - GAIN
        for share in SHARES:
            other, until = plans[1 - i], self._arrivals[1 - i]
            guard = Guard.around(self._game, i, other, until, share)
            plan = guarded_response(guard, cost, budget)
            if plan is not None and (i, plan.controls.tobytes()) not in self._known:
                return plan
        return None
