r"""Programs over all agents at once: the social optimum (MP3) and the potential equilibrium.

    social      min sum_i J_i
    potential   min Phi = sum_i lam_i/(1-lam_i) T_i + sum own-obstacle losses + sum_{i<j} c_ij

They differ in their weights alone: MP3 counts each pair's losses for both agents, Phi once.
A minimiser of Phi is a Nash equilibrium, since one agent's change of plan changes J_i by
(1 - lam_i) times the change of Phi.
"""

from __future__ import annotations

from dataclasses import replace

from ppg_env import objective
from ppg_env.game import Game
from solvers.certificate import certify
from solvers.clock import Clock
from solvers.minimise import ENGINE, check_solver, minimise
from solvers.response import explain
from solvers.solution import Solution


def social_optimum(
    game: Game, *, solver: str = ENGINE, time_limit: float | None = None
) -> Solution:
    """The profile that minimises the sum of all shifted costs, and a proved lower bound on it."""
    return _joint(game, "social", "social_cost", objective.social(game), solver, time_limit)


def potential_equilibrium(
    game: Game, *, solver: str = ENGINE, time_limit: float | None = None
) -> Solution:
    """The Nash equilibrium that minimises the potential, certified by best responses.

    ``regret`` bounds what each agent could gain alone.  Within a time limit the plan may stop
    short of the minimum; ``regret`` then still holds for the plan returned.
    """
    clock = Clock(time_limit)
    solution = _joint(game, "potential", "potential", objective.potential(game), solver, time_limit)
    if solution.profile is None:
        return solution
    proof = certify(game, solution.profile, solver=solver, time_limit=clock.left)
    return replace(solution, regret=proof.regret, seconds=clock.spent)


def _joint(
    game: Game,
    name: str,
    minimised: str,
    weights: objective.Weights,
    solver: str,
    time_limit: float | None,
) -> Solution:
    solver, clock, everybody = check_solver(solver), Clock(time_limit), range(len(game.agents))
    found = minimise(game, everybody, weights, None, solver, clock)
    status, advice = explain(game, found, tuple(everybody))
    return Solution(
        game,
        name,
        status,
        advice,
        found.profile,
        found.evaluation,
        minimised,
        found.value,
        found.bound,
        seconds=clock.spent,
    )
