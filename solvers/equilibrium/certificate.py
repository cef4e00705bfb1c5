r"""Certificates of equilibrium: how much could each agent still gain by changing alone?

    regret_i = J_i(profile) - min over its own plans of J_i  <=  J_i(profile) - bound_i

J_i is the evaluator's, bound_i the dual bound of a best response, which holds even when that
solve stopped early.  A profile is an epsilon-equilibrium for epsilon = max_i regret_i.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver
from solvers.equilibrium.best_response import respond
from solvers.liability import make_rule
from solvers.search_result import SearchResult


@dataclass(frozen=True)
class Certificate:
    """Proved upper bounds on regret.

    Attributes
    ----------
    cost : (N,) what each agent pays in the profile: its shifted cost J_i, if selfish.
    bound : (N,) proved lower bound on what that could be by own choice.
    regret : (N,) cost - bound, never negative.
    """

    cost: np.ndarray
    bound: np.ndarray

    @property
    def regret(self) -> np.ndarray:
        """(N,) certified upper bound on each agent's possible gain."""
        return np.maximum(self.cost - self.bound, 0.0)

    @property
    def epsilon(self) -> float:
        """The profile is an epsilon-equilibrium with this epsilon."""
        return float(self.regret.max())


def certify(
    game: Game,
    profile: Profile,
    *,
    charge: str = "selfish",
    solver: str = ENGINE,
    time_limit: float | None = None,
) -> Certificate:
    """Bound every agent's regret in ``profile``; ``time_limit`` (seconds) is for all together.

    Regret is about what agents pay under the rule ``charge`` (:mod:`solvers.liability`).

    Raises
    ------
    InputError
        If the evaluator does not accept the profile, or an option does not exist.
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
    costs, bounds = [], []
    for i in range(len(game.agents)):
        costs.append(evaluation.weighted(rule.costs[i]))
        found = respond(rule, i, profile, solver, budget)
        bounds.append(proved_bound(game, i, costs[-1], found))
    return Certificate(np.array(costs), np.array(bounds))


def proved_bound(game: Game, agent: int, cost: float, found: SearchResult) -> float:
    """The bound of a best response, unless the plan in hand refutes it.

    A bound above a cost that the evaluator found is a back end's error; what is left then is
    the cost of the agent's time at top speed, with no losses at all.
    """
    if found.bound <= cost + tol.AGREEMENT * max(1.0, abs(cost)):
        return found.bound
    from ppg_env.game.reachability import earliest_arrival

    fastest = earliest_arrival(game.agents[agent], game.horizon) or 0
    return game.agents[agent].lam * fastest
