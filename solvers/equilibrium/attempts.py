"""Starts of best-response dynamics that did not let all agents find a plan."""

from __future__ import annotations

from solvers.budget import Budget
from solvers.equilibrium.best_response import explain
from solvers.equilibrium.outcomes import NAME
from solvers.equilibrium.start_profile import WAITING, Entry
from solvers.liability import Liability
from solvers.search_result import SearchResult
from solvers.solution import Solution, Status

KINDS = {
    "straight": "straight flights",
    "sequential": "sequential entry in {count} orders",
    WAITING: "entry past agents that wait in {count} orders",
}
"""Names of the starts in messages."""


class Attempts:
    """The starts that were tried in vain, and the message about them."""

    def __init__(self, rule: Liability, budget: Budget) -> None:
        self._rule, self._budget = rule, budget
        self._tried: dict[Entry, Solution] = {}
        self.looked_for_ways = False

    def add(self, entry: Entry, solution: Solution) -> None:
        """Note that a start led to a ``solution`` without plans."""
        self._tried.pop(entry, None)
        self._tried[entry] = solution

    def excluded(self, entry: Entry) -> bool:
        """Return whether it is proved that a start leads to no plans."""
        return entry in self._tried and self._tried[entry].status is Status.INFEASIBLE

    def stopped(self) -> Solution:
        """Return that the time is over."""
        advice = (
            f"the time limit came before the first plan (tried: {self._names}); raise it, give a "
            "start, or cut the horizon"
        )
        return self._without_plans(Status.NO_INCUMBENT, advice)

    def failed(self, least: SearchResult | None) -> Solution:
        """Return that no start let all agents find a plan, and what may help.

        ``least`` is the search for the least potential, if there was one: if it found that there
        are no plans at all, this is the reason.
        """
        game, last = self._rule.game, self._last
        if least is not None and least.status not in (Status.NO_INCUMBENT, Status.ERROR):
            return self._without_plans(*explain(game, least, tuple(range(len(game.agents)))))
        joint = "" if least is None else ", nor did a search for joint plans find any"
        return self._without_plans(
            last.status if least is None else Status.NO_INCUMBENT,
            f"none of {len(self._tried)} starts and orders let every agent find a plan{joint} "
            f"(tried: {self._names}; at last, {last.advice}); give a start, lengthen the horizon, "
            "or raise the time limit",
        )

    @property
    def _last(self) -> Solution:
        return next(reversed(self._tried.values()))

    @property
    def _names(self) -> str:
        """What was tried, in the order in which it was tried."""
        counts: dict[str, int] = {}
        for entry in self._tried:
            counts[str(entry.start)] = counts.get(str(entry.start), 0) + 1
        names = [KINDS[kind].format(count=count) for kind, count in counts.items()]
        return ", ".join(names + ["ways of all agents past each other"] * self.looked_for_ways)

    def _without_plans(self, status: Status, advice: str) -> Solution:
        trace, seconds = self._last.trace, self._budget.spent
        return Solution(self._rule.game, NAME, status, advice, trace=trace, seconds=seconds)
