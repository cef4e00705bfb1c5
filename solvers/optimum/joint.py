r"""Programs over all agents: the social optimum (MP3) and the potential equilibrium.

    social      min sum_i J_i
    potential   min Phi = sum_i lam_i/(1-lam_i) T_i + sum own-obstacle losses + sum_{i<j} c_ij

Both minimise the potential of a liability rule (:mod:`solvers.liability`): ``pigou`` for MP3, which
counts each pair's losses for both agents, and ``selfish`` for Phi, which counts them once.
A minimiser of Phi is a Nash equilibrium, since one agent's change of plan changes J_i by
(1 - lam_i) times the change of Phi.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ppg_env.game.earliest_way import earliest_way, has_walls
from ppg_env.game.game import Game
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver, minimise, tidied
from solvers.equilibrium.best_response import explain
from solvers.equilibrium.certificate import certify
from solvers.liability import Liability, make_rule
from solvers.optimum.annealing import descent
from solvers.optimum.first_plans import equilibrium_plans, first_plans
from solvers.optimum.pair_bound import pair_bound
from solvers.pricing import PricedProfile, price_profile
from solvers.search_result import Claims, SearchResult, conclude
from solvers.solution import Solution, Status
from solvers.units import in_units_of_the_game

BOUND_SHARE = 0.3
"""Part of the time limit that the bound may take."""

CERTIFICATE_SHARE = 0.15
"""Part of the time limit that is kept for the certificate of an equilibrium."""

MOST_EXACT = 5
"""With more agents than this, optima are approximated and bounded, not proved."""

APPROXIMATE = (
    "found by neighbourhood search and bounded by pairs: the gap is proved, the optimum is not"
)

OnProgress = Callable[[str, float], None]
"""Called with what improved, ``value`` or ``bound``, and its new value."""


@in_units_of_the_game
def social_optimum(
    game: Game,
    *,
    start: Profile | None = None,
    solver: str = ENGINE,
    time_limit: float | None = None,
    node_limit: int | None = None,
    seed: int = 0,
    progress: OnProgress | None = None,
) -> Solution:
    """Find the profile that minimises the sum of all shifted costs, with a proved lower bound.

    Up to five agents the optimum is proved.  With more, annealing
    (:mod:`solvers.optimum.annealing`, drawn from ``seed``) and a bound from pairs
    (:mod:`solvers.optimum.pair_bound`) leave a gap, which is reported.

    Parameters
    ----------
    start
        Plans of all agents that are known, as those of an equilibrium: the result costs no more.
        They have no effect if they are not feasible, or with another solver than the engine.
    solver, time_limit, node_limit
        Name of the solver; limits on seconds and on linear programs of the engine.  At a limit,
        the solution has the best plans so far and a valid bound.
    progress
        Called with every better value and bound.
    """
    rule, budget = make_rule(game, "pigou"), Budget(time_limit, node_limit)
    known = None if start is None else price_profile(_potential(rule), start)
    return _minimise_potential(rule, "social", "social_cost", solver, budget, seed, progress, known)


@in_units_of_the_game
def potential_equilibrium(
    game: Game,
    *,
    solver: str = ENGINE,
    time_limit: float | None = None,
    node_limit: int | None = None,
    seed: int = 0,
    progress: OnProgress | None = None,
) -> Solution:
    """Find the Nash equilibrium that minimises the potential, certified by best responses.

    ``regret`` bounds what each agent could gain by a deviation.  At a limit, or with more than five
    agents, the potential may be above its minimum; ``regret`` still holds for the plans returned:
    an agent gains at most (1 - lam_i) times the gap of the potential.  The certificate takes its
    share of the time.  Parameters as for :func:`social_optimum`.
    """
    rule, budget = make_rule(game, "selfish"), Budget(time_limit)
    share = None if time_limit is None else time_limit * (1 - CERTIFICATE_SHARE)
    search = Budget(share, node_limit)
    solution = _minimise_potential(rule, "potential", "potential", solver, search, seed, progress)
    if solution.profile is None:
        return replace(solution, seconds=budget.spent)
    regret = certify(game, solution.profile, solver=solver, time_limit=budget.left).regret
    if solution.status is not Status.OPTIMAL:
        care = np.array([1 - agent.lam for agent in game.agents])
        regret = np.minimum(regret, care * max(solution.value - solution.bound, 0.0))
    return replace(solution, regret=regret, seconds=budget.spent)


def _minimise_potential(
    rule: Liability,
    name: str,
    minimised: str,
    solver: str,
    budget: Budget,
    seed: int,
    progress: OnProgress | None,
    known: PricedProfile | None = None,
) -> Solution:
    """Minimise the potential of ``rule`` over the plans of all agents; some may be ``known``."""
    game, potential = rule.game, _potential(rule)
    solver, agents = check_solver(solver), tuple(range(len(game.agents)))
    on_progress = progress or (lambda what, value: None)
    on_value = partial(on_progress, "value")
    if len(agents) > MOST_EXACT and solver == ENGINE:
        result = _approximate(rule, budget, seed, on_progress, known)
    else:
        walled = len(agents) > 1 and any(has_walls(game, i) for i in agents)
        first = first_plans(rule, walled, budget, on_value, known) if solver == ENGINE else None

        def advise() -> Profile | None:
            return None if walled else equilibrium_plans(game, budget).profile

        result = minimise(potential, agents, first, solver, budget, on_progress, advise)
    result = tidied(potential, agents, result)
    status, advice = explain(game, result, agents)
    return Solution(
        game,
        name,
        status,
        APPROXIMATE if status is Status.FEASIBLE and result.detail == APPROXIMATE else advice,
        result.profile,
        result.evaluation,
        minimised,
        result.value,
        result.bound,
        seconds=budget.spent,
    )


def _approximate(
    rule: Liability,
    budget: Budget,
    seed: int,
    on_progress: OnProgress,
    known: PricedProfile | None,
) -> SearchResult:
    """Return plans by annealing and a bound from pairs, which takes its share of the time.

    If annealing finds no plan, the exact search uses the rest of the time.
    """
    game, potential = rule.game, _potential(rule)
    if any(earliest_way(game, i) is None for i in range(len(game.agents))):
        return SearchResult(Status.UNREACHABLE, float("inf"))
    bound = -np.inf

    def compute_bound() -> None:
        nonlocal bound
        share = Budget(budget.limit and min(BOUND_SHARE * budget.limit, budget.left or 0.0))
        bound = pair_bound(potential, share, lambda value: on_progress("bound", value))

    on_value = partial(on_progress, "value")
    best = descent(rule, ENGINE, budget, seed, on_value, compute_bound, known)
    if best is None and not budget.out:
        agents = range(len(game.agents))
        return minimise(potential, agents, None, ENGINE, budget, on_progress)
    return conclude(best, Claims(bound, complete=False, detail=APPROXIMATE))


def _potential(rule: Liability) -> Objective:
    """Return the potential of a rule that has one."""
    assert rule.potential is not None
    return rule.potential
