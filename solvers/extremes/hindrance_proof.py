"""Proofs that no plans hinder all deviations: deviations are added until none are left."""

from __future__ import annotations

from ppg_env.game.plan import Plan, Profile
from solvers.budget import Budget
from solvers.equilibrium.best_response import best_response
from solvers.extremes.guard import Guard
from solvers.extremes.guarded_response import guarded_response
from solvers.extremes.hindering_plans import HinderingPlans
from solvers.extremes.rows import Outcome

SHARES = (0.5, 0.25, 0.1, 0.03, 0.0)
"""Parts of what the other agent can reach, around its plan, that deviations are guarded against."""


class HindranceProof:
    """The proof for one program; ``deviations`` grow, and serve other proofs.

    Attributes
    ----------
    witness : the plan that hinders all deviations, with the response to it, if there is one.
    """

    def __init__(self, program: HinderingPlans, deviations: list[Plan]) -> None:
        self._program, self._deviations = program, deviations
        self.witness: Profile | None = None
        for plan in deviations:
            program.add(plan)

    def search(self, rounds: int, nodes: int, budget: Budget) -> bool:
        """Return whether the proof is complete within so many programs of so many nodes."""
        for _ in range(rounds):
            outcome, other = self._program.point(budget, nodes)
            if other is None:
                return outcome is Outcome.NONE
            if not self._excludes(other, budget):
                return False
        return False

    def _excludes(self, other: Plan, budget: Budget) -> bool:
        """Add a deviation that ``other`` does not hinder, if one is found."""
        program = self._program
        for share in SHARES:
            guard = Guard.around(program.game, program.i, other, program.arrival, share)
            plan = guarded_response(guard, program.most, budget)
            if plan is not None and program.add(plan, guard.losses(plan)):
                self._deviations.append(plan)
                return True
        pair = (other, other)
        solution = best_response(program.game, program.i, pair, time_limit=budget.left)
        self.witness = solution.profile
        return False
