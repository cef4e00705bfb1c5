r"""Best-response dynamics: agents update their plans in turn until no agent gains.

With the exact potential Phi, every accepted update lowers Phi by at least
``tolerance / (1 - lam_i)``, so updates in turn end at an equilibrium; simultaneous updates may
cycle, which is detected.  Other liability rules have other potentials, or none
(:mod:`solvers.liability`): right of way still ends in turn, and the rest may cycle.

Without a given start, several are tried until one lets all agents find a plan:

1. straight (up to five agents), and sequential in the order of the updates,
2. plans along ways of all agents past each other (:mod:`solvers.engine.joint_plans`),
3. sequential in the reverse order and in random ones, and the same while agents that have not
   entered stand at their starts,
4. the same once more with more effort for each response,
5. plans of low potential.

Each has its share of linear programs, so that results do not depend on the machine.  Among walls
and with a time limit, ways come first.

Proofs are costly and early ones are soon out of date, so responses begin with few linear programs,
and the number grows once no agent gains.  Proofs that stay valid
(:mod:`solvers.equilibrium.regret_proofs`) are not repeated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ppg_env import tolerances as tol
from ppg_env.game.earliest_way import has_walls
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver, minimise
from solvers.engine.joint_plans import MOST_DIMENSIONS, find_joint_plans
from solvers.engine.presolve import Subproblem
from solvers.equilibrium.attempts import Attempts
from solvers.equilibrium.dynamics_run import FIRST_EFFORT, DynamicsRun, Purpose
from solvers.equilibrium.start_profile import Entry, default_entries
from solvers.equilibrium.update_order import check_order
from solvers.liability import Liability, make_rule
from solvers.search_result import SearchResult
from solvers.solution import Solution, Status, Update
from solvers.units import in_units_of_the_game

ENTRY_EFFORT = 8000
"""Linear programs for one response at most, while another start may be tried instead."""

POTENTIAL_EFFORT = 50_000
"""Linear programs for the potential's minimum, if no other start lets all agents find a plan."""

BEFORE_WAYS = 2
"""Starts that are tried before ways of all agents past each other are looked for."""

MOST_BEFORE_WAYS = 1
"""With more agents than this among walls, ways come first if there is a time limit: entries would
be cut at a time that is never the same, and so would be the plans."""

WAYS_SHARE = 0.25
"""Part of the time limit that the entry in these starts may take among walls."""

PROOF = Purpose()
"""Dynamics that end with an equilibrium and its proof."""


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
    purpose: Purpose = PROOF,
) -> Solution:
    """Run :func:`best_response_dynamics` under a rule, for options that were checked.

    A run for plans that has only a ``share`` of the time enters as one that has all of it.
    """
    deadline, whole = _deadline(rule, budget), budget
    if budget.limit is not None:
        budget = Budget(purpose.share * budget.limit - budget.spent, budget.nodes)

    def run(entry: Entry, effort: int | None, deadline: float | None = None) -> Solution:
        dynamics = DynamicsRun(
            rule, order, tolerance, solver, budget, seed, progress, purpose, deadline
        )
        return dynamics.run(entry, max_sweeps, most=effort)

    if start is not None:
        return run(Entry(start), None)
    attempts = Attempts(rule, budget)
    entries = list(default_entries(rule, seed))
    many = deadline is not None and len(rule.game.agents) > MOST_BEFORE_WAYS
    before_ways = 0 if many else BEFORE_WAYS
    for effort in (FIRST_EFFORT, ENTRY_EFFORT):
        for number, entry in enumerate(entries):
            if effort == FIRST_EFFORT and number == before_ways:
                attempts.looked_for_ways = rule.game.dim <= MOST_DIMENSIONS
                plans = _along_ways(rule, whole)
                if plans is not None:
                    return run(Entry(plans), None)
            if effort > FIRST_EFFORT and attempts.excluded(entry):
                continue
            early = effort == FIRST_EFFORT and number < before_ways
            solution = run(entry, effort, deadline if early else None)
            if solution.profile is not None or not _may_be_mended(solution):
                return solution
            attempts.add(entry, solution)
            if budget.out:
                return attempts.stopped()
    least = _least_potential(rule, solver, budget) if purpose.jointly else None
    if least is not None and least.profile is not None:
        return run(Entry(least.profile), None)
    return attempts.failed(least)


def _deadline(rule: Liability, budget: Budget) -> float | None:
    """Return the seconds after which ways are looked for, if there are walls and a time limit."""
    game = rule.game
    if budget.limit is None or not any(has_walls(game, i) for i in range(len(game.agents))):
        return None
    return WAYS_SHARE * budget.limit


def _along_ways(rule: Liability, budget: Budget) -> Profile | None:
    """Return plans along ways of all agents past each other, if some are found."""
    if rule.potential is None:
        return None
    agents = tuple(range(len(rule.game.agents)))
    plans = find_joint_plans(Subproblem(rule.potential, agents, {}), budget.child(None))
    return None if plans is None else plans.profile


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
