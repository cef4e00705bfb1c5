r"""Best-response dynamics: agents update their plans in turn until no agent gains.

With the exact potential Phi, every accepted update lowers Phi by at least
``tolerance / (1 - lam_i)``, so updates in turn end at an equilibrium; simultaneous updates may
cycle, which is detected.  Other liability rules have other potentials, or none
(:mod:`solvers.liability`): right of way still ends in turn, and the rest may cycle.

Without a given start, several are tried until one lets all agents find a plan: straight (up to five
agents), sequential in the order of the updates, in the reverse order and in random ones, the same
while agents that have not entered stand at their starts, and at last the plans that minimise the
potential.  Each has its share of linear programs, so that results do not depend on the machine.

Proofs are costly and early ones are soon out of date, so responses begin with few linear programs,
and the number grows once no agent gains.  Proofs that stay valid
(:mod:`solvers.equilibrium.regret_proofs`) are not repeated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver, minimise
from solvers.engine.refine import refine
from solvers.engine.tie_break import tidied_in_turn
from solvers.equilibrium.best_response import respond
from solvers.equilibrium.outcomes import Outcomes, without_start
from solvers.equilibrium.regret_proofs import RegretProofs
from solvers.equilibrium.start_profile import Entry, default_entries, start_profile
from solvers.equilibrium.update_order import check_order, sweep_groups
from solvers.liability import Liability, make_rule
from solvers.search_result import SearchResult
from solvers.solution import Solution, Status, Update
from solvers.units import in_units_of_the_game

FIRST_EFFORT, LAST_EFFORT = 1000, 100_000
"""Linear programs for one response: in the first sweeps, and at most before there is no limit."""

ENTRY_EFFORT = 8000
"""Linear programs for one response at most, while another start may be tried instead."""

POTENTIAL_EFFORT = 50_000
"""Linear programs for the potential's minimum, if no other start lets all agents find a plan."""

REFINE_AFTER = 3
"""Sweeps after which plans are refined in between: by then only details change."""


@in_units_of_the_game
def best_response_dynamics(
    game: Game,
    *,
    start: str | Profile | None = None,
    order: str | Sequence[int] = "cyclic",
    charge: str = "selfish",
    tolerance: float = tol.IMPROVEMENT,
    max_sweeps: int = 50,
    seed: int = 0,
    solver: str = ENGINE,
    time_limit: float | None = None,
    progress: Callable[[Update], None] | None = None,
) -> Solution:
    """Find a Nash equilibrium by letting the agents respond to each other in turn.

    Parameters
    ----------
    start
        ``straight`` (every agent plans as if alone), ``sequential`` (each agent responds to those
        before it in the order), or a profile.  By default, straight (up to five agents, and without
        right of way), sequential, and further starts are tried until all agents find a plan.
    order
        ``cyclic`` (the game's order, or that of priority), ``random`` (a new permutation each
        sweep, from ``seed``), ``simultaneous`` (all respond to the same profile), or a permutation
        of the agents.
    charge
        The liability rule (:mod:`solvers.liability`): ``selfish``, ``partial:0.5``, ``pigou``,
        under which every update lowers the social cost, or ``right-of-way``.  Regret refers to
        what agents pay.
    tolerance
        An agent keeps its plan unless it gains more than this.
    max_sweeps, time_limit
        Limits on the sweeps, in which every agent moves once, and on seconds.
    progress
        Called with every :class:`Update`.

    Returns
    -------
    Solution
        ``status`` is ``equilibrium``, ``cycle`` or ``limit``, or why an agent had no plan;
        ``regret`` is certified by the last responses' bounds; ``trace`` has every update.

    Raises
    ------
    InputError
        If an option does not exist, or the start does not fit the game.
    """
    check_order(game, order)
    return run_dynamics(
        make_rule(game, charge),
        check_solver(solver),
        Budget(time_limit),
        start=start,
        order=order,
        tolerance=tolerance,
        max_sweeps=max_sweeps,
        seed=seed,
        progress=progress,
    )


def run_dynamics(
    rule: Liability,
    solver: str,
    budget: Budget,
    *,
    start: str | Profile | None = None,
    order: str | Sequence[int] = "cyclic",
    tolerance: float = tol.IMPROVEMENT,
    max_sweeps: int = 50,
    seed: int = 0,
    progress: Callable[[Update], None] | None = None,
    jointly: bool = True,
) -> Solution:
    """Run :func:`best_response_dynamics` under a rule, for options that were checked.

    ``jointly`` allows the search for the least potential, if no other start helps.
    """
    given = start is not None
    entries = [Entry(start)] if start is not None else default_entries(rule, seed)
    tried = []
    for entry in entries:
        dynamics = _Dynamics(rule, order, tolerance, solver, budget, seed, progress)
        solution = dynamics.run(entry, max_sweeps, patient=given)
        if given or budget.out or solution.profile is not None or not _may_be_mended(solution):
            return solution
        tried.append(solution)
    least = _least_potential(rule, solver, budget) if jointly else None
    if least is not None and least.profile is not None:
        dynamics = _Dynamics(rule, order, tolerance, solver, budget, seed, progress)
        return dynamics.run(Entry(least.profile), max_sweeps, patient=True)
    return without_start(rule, tried, least, budget)


def _may_be_mended(solution: Solution) -> bool:
    """Return whether another start may help: an agent found no plan among those of the others."""
    return solution.status in (Status.INFEASIBLE, Status.NO_INCUMBENT)


def _least_potential(rule: Liability, solver: str, budget: Budget) -> SearchResult | None:
    """Return plans of low potential, if the rule has a potential and several agents move."""
    size = len(rule.game.agents)
    if rule.potential is None or size == 1:
        return None
    child = budget.child(POTENTIAL_EFFORT)
    result = minimise(rule.potential, range(size), None, solver, child)
    budget.charge(child)
    return result


class _Dynamics:
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
    ) -> None:
        self.rule, self.game, self.order, self.tolerance = rule, rule.game, order, tolerance
        self.solver, self.budget, self.progress = solver, budget, progress
        self.random = np.random.default_rng(seed)
        self.trace: list[Update] = []
        self.tidy = False
        self.proofs = RegretProofs(rule.game, tolerance)
        self.outcomes = Outcomes(rule, self.trace, budget)

    def run(self, entry: Entry, max_sweeps: int, *, patient: bool) -> Solution:
        """Update in turn until no agent gains, the profile repeats, or a limit is reached.

        A ``patient`` run searches for a first plan of each agent as long as the budget lasts.
        """
        profile, pending = start_profile(self.rule, entry.start)
        visited = {profile}
        effort: int | None = FIRST_EFFORT
        for sweep in range(1, max_sweeps + 1):
            before, self.changed = profile, False
            order = self.order if sweep > 1 or entry.order is None else entry.order
            for group in sweep_groups(self.rule, order, self.random):
                responses = {}
                for i in group:
                    if i not in pending and self.proofs.holds(i):
                        continue
                    responses[i] = self._respond(i, profile, effort, patient)
                    if responses[i].profile is None:
                        return self.outcomes.without_response(profile, not pending, i, responses[i])
                profile = self._adopt(sweep, profile, responses, pending)
                pending -= set(group)
            if not self.changed and not self.tidy:
                profile = self._tidied(profile)
            elif not self.changed:
                if effort is None or all(self.proofs.holds(i) for i in range(len(profile))):
                    return self.outcomes.converged(profile, self.proofs.bounds)
                effort = effort * 8 if effort < LAST_EFFORT else None
            elif profile in visited and profile != before:
                return self.outcomes.finished(profile, Status.CYCLE)
            elif sweep >= REFINE_AFTER and self.order != "simultaneous":
                profile = self._refined(profile)
            visited.add(profile)
            if self.budget.out:
                break
        return self.outcomes.finished(profile, Status.NOT_CONVERGED)

    def _respond(self, i: int, profile: Profile, effort: int | None, patient: bool) -> SearchResult:
        """Respond with ``effort`` linear programs; with more if they do not suffice for a plan."""
        while True:
            child = self.budget.child(effort)
            response = respond(self.rule, i, profile, self.solver, child)
            self.budget.charge(child)
            if response.status is not Status.NO_INCUMBENT or effort is None or self.budget.out:
                return response
            if effort >= ENTRY_EFFORT and not patient:
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
        for i, (before, after) in costs.items():
            self.trace.append(Update(sweep, i, before, after, potential))
            if self.progress is not None:
                self.progress(self.trace[-1])
