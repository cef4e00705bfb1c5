r"""Certificates of equilibrium: upper bounds on what each agent gains by a deviation.

    regret_i = J_i(profile) - min over its own plans of J_i  <=  J_i(profile) - bound_i

J_i is the evaluator's, bound_i the dual bound of a best response, which holds even when that
solve stopped early.  A profile is an epsilon-equilibrium for epsilon = max_i regret_i.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env.errors import InputError
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver
from solvers.equilibrium.best_response import respond
from solvers.equilibrium.regret_proofs import proved_bound
from solvers.liability import make_rule
from solvers.units import in_units_of_the_game


@dataclass(frozen=True)
class Certificate:
    """Proved upper bounds on regret.

    Attributes
    ----------
    cost : (N,) what each agent pays in the profile: its shifted cost J_i, if selfish.
    bound : (N,) proved lower bound on what it pays after any deviation.
    regret : (N,) cost - bound, never negative.
    """

    cost: np.ndarray
    bound: np.ndarray

    @property
    def regret(self) -> np.ndarray:
        """(N,) certified upper bound on each agent's gain by a deviation."""
        return np.maximum(self.cost - self.bound, 0.0)

    @property
    def epsilon(self) -> float:
        """The largest regret: the profile is an epsilon-equilibrium."""
        return float(self.regret.max())


@in_units_of_the_game
def certify(
    game: Game,
    profile: Profile,
    *,
    charge: str = "selfish",
    solver: str = ENGINE,
    time_limit: float | None = None,
) -> Certificate:
    """Bound every agent's regret in ``profile`` from above.

    Parameters
    ----------
    profile
        A feasible plan of every agent.
    charge
        The liability rule (:mod:`solvers.liability`) that defines what agents pay.
    solver, time_limit
        Name of the solver; seconds for all agents together, None for no limit.

    Raises
    ------
    InputError
        If the profile is not feasible, or an option does not exist.
    """
    rule = make_rule(game, charge)
    solver, budget = check_solver(solver), Budget(time_limit)
    evaluation = evaluate(game, profile)
    violations = evaluation.violations()
    if violations:
        raise InputError(
            "profile",
            f"is no plan to certify, since {violations[0]}",
            "certify a plan that a planner returned",
        )
    costs = [evaluation.weighted(cost) for cost in rule.costs]
    bounds = []
    for i, cost in enumerate(costs):
        response = respond(rule, i, profile, solver, budget)
        bounds.append(proved_bound(game, i, cost, response))
    return Certificate(np.array(costs), np.array(bounds))
