"""The queue of arrival vectors, cheapest bound first."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import count

from ppg_env.game.barriers import starts_at_goal
from solvers.engine.branch_and_bound import BranchAndBound
from solvers.engine.presolve import PresolvedEncounter, Subproblem, presolve_encounters

MOST_PRESOLVED = 64
"""Vectors whose presolved encounters are kept until their search begins."""


class ArrivalQueue:
    """Arrival vectors that the reachable sets allow, cheapest bound first.

    A vector waits with its time cost, which is known at once.  When it comes up, its encounters
    are presolved and its successors, which cost no less, enter: those one step later in the
    coordinate that was raised last, or in a later coordinate.

    Parameters
    ----------
    first : earliest arrival of each mover.
    representative : whether a vector stands for its orbit under the symmetries of the game.
    """

    def __init__(
        self,
        subproblem: Subproblem,
        first: Mapping[int, int],
        representative: Callable[[Mapping[int, int]], bool],
    ) -> None:
        self._subproblem, self._representative = subproblem, representative
        game = subproblem.game
        self._latest = [
            0 if starts_at_goal(game.agents[i]) else game.horizon for i in subproblem.movers
        ]
        self.presolved = lru_cache(maxsize=MOST_PRESOLVED)(self._presolve)
        self._order = count()
        self._heap: list[tuple[float, int, tuple[int, ...], int | None, BranchAndBound | None]] = []
        self._push_unchecked(tuple(first[i] for i in subproblem.movers), 0)

    @property
    def least(self) -> float:
        """Lower bound on all queued vectors; infinite if there are none."""
        return self._heap[0][0] if self._heap else float("inf")

    def push(self, bound: float, arrivals: Mapping[int, int], tree: BranchAndBound | None) -> None:
        """Queue a presolved vector with a bound, and with the search that was started."""
        times = tuple(arrivals[i] for i in self._subproblem.movers)
        heapq.heappush(self._heap, (bound, next(self._order), times, None, tree))

    def pop(self, below: float) -> tuple[float, dict[int, int], BranchAndBound | None] | None:
        """Return the next vector with its bound and search; None if none is left below a cost."""
        subproblem = self._subproblem
        while self._heap and self.least < below:
            bound, _, times, raised, tree = heapq.heappop(self._heap)
            arrivals = dict(zip(subproblem.movers, times, strict=True))
            if raised is None:
                return bound, arrivals, tree
            for k in range(raised, len(times)):
                if times[k] < self._latest[k]:
                    self._push_unchecked((*times[:k], times[k] + 1, *times[k + 1 :]), k)
            if not self._representative(arrivals):
                continue
            presolved = self.presolved(times)
            if presolved is not None:
                weights = subproblem.objective.encounter
                losses = sum(weights[e.index] * (e.fixed_loss + e.least) for e in presolved)
                self.push(bound + float(losses), arrivals, None)
        return None

    def _presolve(self, times: tuple[int, ...]) -> list[PresolvedEncounter] | None:
        """Return the presolved encounters of a vector; None if it is infeasible."""
        arrivals = dict(zip(self._subproblem.movers, times, strict=True))
        return presolve_encounters(self._subproblem, self._subproblem.encounters, arrivals)

    def _push_unchecked(self, times: tuple[int, ...], raised: int) -> None:
        """Queue a vector with its time cost; coordinate ``raised`` was increased last."""
        pairs = zip(self._subproblem.movers, times, strict=True)
        bound = float(sum(self._subproblem.objective.time[i] * t for i, t in pairs))
        heapq.heappush(self._heap, (bound, next(self._order), times, raised, None))
