"""Solutions of best-response dynamics: how a run ended, and with which plans."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.between_steps import overlap_times
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.equilibrium.best_response import explain
from solvers.liability import Liability
from solvers.search_result import SearchResult
from solvers.solution import ADVICE, Solution, Status, Update

NAME = "nash"


class Outcomes:
    """Builds the solution of one run, with its trace and the time that it took."""

    def __init__(self, rule: Liability, trace: Sequence[Update], budget: Budget) -> None:
        self._rule, self._game, self._trace, self._budget = rule, rule.game, trace, budget

    def _without_plans(self, status: Status, advice: str) -> Solution:
        trace, seconds = tuple(self._trace), self._budget.spent
        return Solution(self._game, NAME, status, advice, trace=trace, seconds=seconds)

    def finished(
        self, profile: Profile, status: Status, regret: np.ndarray | None = None
    ) -> Solution:
        """Return the profile with its evaluation; no plans if simultaneous updates collide."""
        evaluation = evaluate(self._game, profile)
        if not evaluation.feasible:
            advice = f"{ADVICE[status]}; {evaluation.violations()[0]}"
            return self._without_plans(status, advice)
        return Solution(
            self._game,
            NAME,
            status,
            ADVICE[status],
            profile,
            evaluation,
            regret=regret,
            trace=tuple(self._trace),
            seconds=self._budget.spent,
        )

    def converged(self, profile: Profile, bounds: np.ndarray) -> Solution:
        """Return the profile that no agent left in the last sweep, with its certified regret.

        It is an equilibrium only if the ``bounds`` (N,) on what agents pay prove it: responses
        that the time limit stopped may have missed a gain.
        """
        evaluation = evaluate(self._game, profile)
        if not evaluation.feasible:
            return self.finished(profile, Status.EQUILIBRIUM)
        costs = np.array([evaluation.weighted(cost) for cost in self._rule.costs])
        regret = np.maximum(costs - bounds, 0.0)
        proved = regret.max() <= tol.EQUILIBRIUM
        status = Status.EQUILIBRIUM if proved else Status.NOT_CONVERGED
        return self.finished(profile, status, regret)

    def without_response(
        self, profile: Profile, complete: bool, agent: int, response: SearchResult
    ) -> Solution:
        """Return why ``agent`` has no plan, or the profile if only a limit is the reason.

        ``complete`` is whether all agents have plans in ``profile``.
        """
        feasible = complete and evaluate(self._game, profile).feasible
        if feasible and response.status is Status.NO_INCUMBENT:
            return self.finished(profile, Status.NOT_CONVERGED)
        status, advice = explain(self._game, response, (agent,))
        if status is Status.INFEASIBLE:
            advice = _no_way(self._game, agent)
        return self._without_plans(status, advice)


def _no_way(game: Game, agent: int) -> str:
    return (
        f"{game.agent_names[agent]} has no plan free of overlap {overlap_times(game)} while the "
        "others keep theirs; start from another profile or order, or lengthen the horizon"
    )
