r"""Programs over all agents at once: the social optimum (MP3) and the potential equilibrium.

    social      min sum_i J_i
    potential   min Phi = sum_i lam_i/(1-lam_i) T_i + sum own-obstacle losses + sum_{i<j} c_ij

They differ in their weights alone: MP3 counts each pair's losses for both agents, Phi once.
A minimiser of Phi is a Nash equilibrium, since one agent's change of plan changes J_i by
(1 - lam_i) times the change of Phi.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ppg_env import tolerances as tol
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Profile
from ppg_env.game.reachability import earliest_arrival
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver, minimise
from solvers.equilibrium.best_response import explain
from solvers.equilibrium.best_response_dynamics import best_response_dynamics
from solvers.equilibrium.certificate import certify
from solvers.liability import Liability, make_rule
from solvers.optimum.annealing import descent
from solvers.optimum.pair_bound import pair_bound
from solvers.search_result import SearchResult
from solvers.solution import Solution, Status

BOUND_SHARE = 0.3
"""Part of the time limit that the bound may take."""

MOST_EXACT = 5
"""With more agents than this optima are approached, and bounded, but not proved."""

SOON = 3
"""Up to so many agents the exact search has plans at once."""

APPROACHED = (
    "found by neighbourhood search and bounded by pairs: the gap is proved, the optimum is not"
)

Progress = Callable[[str, float], None]
"""Called with what got better, ``value`` or ``bound``, and to what."""


def social_optimum(
    game: Game,
    *,
    solver: str = ENGINE,
    time_limit: float | None = None,
    node_limit: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Solution:
    """The profile that minimises the sum of all shifted costs, and a proved lower bound on it.

    Up to five agents the optimum is proved; with more, the engine's neighbourhood search
    (:mod:`solvers.optimum.annealing`, drawn from ``seed``) and a bound from pairs
    (:mod:`solvers.optimum.pair_bound`) leave a gap, which is reported.

    Parameters
    ----------
    solver, time_limit, node_limit
        Who solves; seconds, and linear programs of the engine, at most.  Cut short, the solution
        has the best plans so far and a valid bound.
    progress
        Called with every better value and bound.
    """
    rule, budget = make_rule(game, "pigou"), Budget(time_limit, node_limit)
    return _minimise_potential(rule, "social", "social_cost", solver, budget, seed, progress)


def potential_equilibrium(
    game: Game,
    *,
    solver: str = ENGINE,
    time_limit: float | None = None,
    node_limit: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Solution:
    """The Nash equilibrium that minimises the potential, certified by best responses.

    ``regret`` bounds what each agent could gain alone.  Within limits, or with more than five
    agents, the plan may stop short of the minimum; ``regret`` then still holds for the plan
    returned.  Parameters as for :func:`social_optimum`.
    """
    rule, budget = make_rule(game, "selfish"), Budget(time_limit, node_limit)
    solution = _minimise_potential(rule, "potential", "potential", solver, budget, seed, progress)
    if solution.profile is None:
        return solution
    proof = certify(game, solution.profile, solver=solver, time_limit=budget.left)
    return replace(solution, regret=proof.regret, seconds=budget.spent)


def _minimise_potential(
    rule: Liability,
    name: str,
    minimised: str,
    solver: str,
    budget: Budget,
    seed: int,
    progress: Progress | None,
) -> Solution:
    game, potential = rule.game, rule.potential
    assert potential is not None
    solver, everybody = check_solver(solver), range(len(game.agents))
    tell = progress or (lambda what, value: None)
    if len(game.agents) > MOST_EXACT and solver == ENGINE:
        found = _approach(rule, potential, budget, seed, tell)
    else:
        known = _known(rule, budget) if solver == ENGINE else None
        found = minimise(potential, everybody, known, solver, budget, tell)
    status, advice = explain(game, found, tuple(everybody))
    return Solution(
        game,
        name,
        status,
        found.detail if found.detail == APPROACHED else advice,
        found.profile,
        found.evaluation,
        minimised,
        found.value,
        found.bound,
        seconds=budget.spent,
    )


def _known(rule: Liability, budget: Budget) -> Profile | None:
    """Plans by best responses, for games in which the exact search may take long to find some."""
    game = rule.game
    if len(game.agents) <= SOON:
        return None
    first = best_response_dynamics(game, charge=rule.charge, max_sweeps=2, time_limit=budget.left)
    return first.profile


def _approach(
    rule: Liability, potential: Objective, budget: Budget, seed: int, tell: Progress
) -> SearchResult:
    """Plans by neighbourhood search, after a bound from pairs that takes its share of the time.

    Where that finds no plan at all, the exact search has the rest of the time.
    """
    game = rule.game
    if any(earliest_arrival(agent, game.horizon) is None for agent in game.agents):
        return SearchResult(Status.UNREACHABLE, float("inf"))
    share = Budget(None if budget.left is None else budget.left * BOUND_SHARE)
    bound = pair_bound(potential, share, lambda value: tell("bound", value))
    profile = descent(rule, ENGINE, budget, seed, lambda value: tell("value", value))
    if profile is None and budget.out:
        return SearchResult(Status.NO_INCUMBENT, bound)
    if profile is None:
        return minimise(potential, range(len(game.agents)), None, ENGINE, budget, tell)
    evaluation = evaluate(game, profile)
    value = evaluation.weighted(potential)
    proved = value - bound <= tol.AGREEMENT * max(1.0, abs(value))
    status = Status.OPTIMAL if proved else Status.FEASIBLE
    return SearchResult(status, bound, profile, evaluation, value, "" if proved else APPROACHED)
