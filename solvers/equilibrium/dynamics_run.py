"""One run of best-response dynamics, from one start."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppg_env.game.evaluation import evaluate
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.engine.refine import refine
from solvers.engine.tie_break import tidied_in_turn
from solvers.equilibrium.best_response import respond
from solvers.equilibrium.outcomes import Outcomes
from solvers.equilibrium.regret_proofs import RegretProofs
from solvers.equilibrium.start_profile import Entry, start_profile
from solvers.equilibrium.update_order import sweep_groups
from solvers.liability import Liability
from solvers.search_result import SearchResult
from solvers.solution import Solution, Status, Update

FIRST_EFFORT, LAST_EFFORT = 1000, 100_000
"""Linear programs for one response: in the first sweeps, and at most before there is no limit."""

UNPROVED_EFFORT = 8000
"""Linear programs for one response at most, where plans matter more than the proof of regrets."""

REFINE_AFTER = 3
"""Sweeps after which plans are refined in between: by then only details change."""

EARLY_PART = 0.5
"""Part of the time left that one sweep of :data:`FIRST_EFFORT` may take: if it is short, several
sweeps gain more than the best responses of one."""


@dataclass(frozen=True)
class Purpose:
    """What the plans of best-response dynamics are for.

    Attributes
    ----------
    jointly : whether the least potential is searched for, if no other start helps.
    thorough : whether regrets are proved; otherwise the run ends with plans whose proof is hard.
    share : part of the time limit after which the run ends.
    accept : called with every feasible profile of all agents.
    effort : linear programs for one response in the first sweeps.
    refine_after : sweeps after which plans are refined in between.
    """

    jointly: bool = True
    thorough: bool = True
    share: float = 1.0
    accept: Callable[[Profile], None] | None = None
    effort: int = FIRST_EFFORT
    refine_after: int = REFINE_AFTER


class DynamicsRun:
    """State of one run: the proofs of regret, and the trace."""

    def __init__(
        self,
        rule: Liability,
        order: str | Sequence[int],
        tolerance: float,
        solver: str,
        budget: Budget,
        seed: int,
        progress: Callable[[Update], None] | None,
        purpose: Purpose,
        deadline: float | None = None,
    ) -> None:
        self.rule, self.game, self.order, self.tolerance = rule, rule.game, order, tolerance
        self.solver, self.budget, self.progress = solver, budget, progress
        self.purpose, self.deadline = purpose, deadline
        self.random = np.random.default_rng(seed)
        self.trace: list[Update] = []
        self.tidy = False
        self.proofs = RegretProofs(rule.game, tolerance)
        self.outcomes = Outcomes(rule, self.trace, budget)

    def run(self, entry: Entry, max_sweeps: int, *, most: int | None) -> Solution:
        """Update in turn until no agent gains, the profile repeats, or a limit is reached.

        The search for a first plan of each agent takes ``most`` linear programs, None for as many
        as the budget has.
        """
        profile, pending = start_profile(self.rule, entry.start)
        visited = {profile}
        effort: int | None = self.purpose.effort
        for sweep in range(1, max_sweeps + 1):
            before, self.changed = profile, False
            order = self.order if sweep > 1 or entry.order is None else entry.order
            for group in sweep_groups(self.rule, order, self.random):
                responses = {}
                for i in group:
                    if i not in pending and self.proofs.holds(i):
                        continue
                    responses[i] = self._respond(i, profile, pending, effort, most)
                    if responses[i].profile is None:
                        return self.outcomes.without_response(profile, not pending, i, responses[i])
                profile = self._adopt(sweep, profile, responses, pending)
                pending -= set(group)
            if not self.changed and not self.tidy:
                profile = self._tidied(profile)
            elif not self.changed:
                unproved = not self.purpose.thorough and (effort or 0) >= UNPROVED_EFFORT
                if (
                    effort is None
                    or unproved
                    or all(self.proofs.holds(i) for i in range(len(profile)))
                ):
                    return self.outcomes.converged(profile, self.proofs.bounds)
                effort = effort * 8 if effort < LAST_EFFORT else None
            elif profile in visited and profile != before:
                return self.outcomes.finished(profile, Status.CYCLE)
            elif sweep >= self.purpose.refine_after and self.order != "simultaneous":
                profile = self._refined(profile)
            visited.add(profile)
            if self.budget.out:
                break
        return self.outcomes.finished(profile, Status.NOT_CONVERGED)

    def _respond(
        self, i: int, profile: Profile, pending: set[int], effort: int | None, most: int | None
    ) -> SearchResult:
        """Respond with ``effort`` linear programs; with more if they do not suffice for a plan."""
        while True:
            child = self.budget.child(effort)
            if self.deadline is not None and child.limit is not None and i in pending:
                child.limit = min(child.limit, max(self.deadline - self.budget.spent, 0.0))
            elif effort == FIRST_EFFORT and self.budget.limit is not None and not pending:
                left = self.budget.limit / self.purpose.share - self.budget.spent
                child.limit = min(child.limit or 0.0, EARLY_PART * left / len(profile))
            response = respond(self.rule, i, profile, self.solver, child)
            self.budget.charge(child)
            stopped = child.late or self.budget.out
            if response.status is not Status.NO_INCUMBENT or effort is None or stopped:
                return response
            if most is not None and effort >= most:
                return response
            effort *= 8

    def _tidied(self, profile: Profile) -> Profile:
        """Apply the tie rule to each plan in turn, once; no cost rises."""
        self.tidy = True
        tidy = tidied_in_turn(self.rule.costs, profile)
        for i, plan in enumerate(tidy):
            if plan != profile[i]:
                self.proofs.invalidate(i, profile[i], plan)
        return tidy

    def _refined(self, profile: Profile) -> Profile:
        """Take many small steps at once; like responses, they lower the potential."""
        potential = self.rule.potential
        if potential is None or not evaluate(self.game, profile).feasible:
            return profile
        refined = refine(potential, profile, self.budget)
        for j, plan in enumerate(refined):
            if plan is not profile[j] and plan != profile[j]:
                self.proofs.discard(j)
                self.proofs.invalidate(j, profile[j], plan)
        return refined

    def _adopt(
        self, sweep: int, profile: Profile, responses: dict[int, SearchResult], pending: set[int]
    ) -> Profile:
        """Replace the plans of agents that gain; record costs, bounds and updates."""
        if not responses:
            return profile
        evaluation = evaluate(self.game, profile, as_given=True)
        plans, costs = list(profile), dict[int, tuple[float, float]]()
        for i, response in responses.items():
            usable = i not in pending and evaluation.is_feasible((i,))
            before = evaluation.weighted(self.rule.costs[i]) if usable else float("inf")
            gains = before - response.value > self.tolerance
            if gains:
                assert response.profile is not None
                plans[i] = response.profile[i]
                self.changed = True
            costs[i] = (before, response.value if gains else before)
        for i, response in responses.items():
            self.proofs.record(i, costs[i][1], response)
        for i in responses:
            if plans[i] is not profile[i]:
                self.proofs.invalidate(i, profile[i], plans[i])
        self._report(sweep, tuple(plans), costs, complete=not pending - set(responses))
        return tuple(plans)

    def _report(
        self,
        sweep: int,
        profile: Profile,
        costs: Mapping[int, tuple[float, float]],
        complete: bool,
    ) -> None:
        """Append an update per response to the trace; ``complete`` if all agents have plans."""
        evaluation, objective = evaluate(self.game, profile, as_given=True), self.rule.potential
        potential = float("nan") if objective is None else evaluation.weighted(objective)
        if not (complete and evaluation.feasible):
            potential = float("inf")
        elif self.purpose.accept is not None:
            self.purpose.accept(profile)
        for i, (before, after) in costs.items():
            self.trace.append(Update(sweep, i, before, after, potential))
            if self.progress is not None:
                self.progress(self.trace[-1])
