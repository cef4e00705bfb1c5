r"""Branch and bound over faces, for fixed arrivals.

A node has chosen faces for some disjunctions (an encounter at a time); elsewhere margins are free.
Its linear program is a lower bound, and its means are plans that can be priced, so every node may
improve the incumbent.  The branching rule (:mod:`solvers.engine.branching_rule`) branches where
the relaxation underestimates the loss most.  One choice moves the means apart at neighbouring
times too, so that few disjunctions have to be decided.

The search plunges: the next linear program (:mod:`solvers.engine.node_lp`) differs by a row or
two.  After a plunge it continues at the lowest bound.  Once the search has cost enough, cuts
(lower bounds on the joint loss of some encounters) are added as rows.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Protocol

import numpy as np

from ppg_env import tolerances as tol
from solvers.budget import Budget
from solvers.engine.branching_rule import children, relaxation_errors, select_disjunction
from solvers.engine.disjunction import Choice
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.node_lp import Relaxation
from solvers.engine.symmetry import Symmetry

BAND = 0.1
"""Nodes within this share of the gap from the lowest bound are searched depth first: they have to
be searched in any case, and linear programs that differ little are solved faster."""


@dataclass(frozen=True)
class Cut:
    """The weighted losses of ``encounters`` add up to at least ``least`` for these arrivals."""

    encounters: tuple[int, ...]
    least: float


class CutSource(Protocol):
    """A source of cuts."""

    @property
    def due(self) -> bool:
        """Whether the search has cost enough to pay for cuts."""

    def cuts(self) -> Iterable[Cut]:
        """Yield all cuts."""


class BranchAndBound:
    """The search for one arrival vector, below the cost of the incumbent.

    Open nodes wait in a queue with their bounds, and each plunge starts at the lowest.

    Parameters
    ----------
    make, spent : builds the program when it is needed; the time cost of its arrivals.
    upper : cost of the incumbent; only cheaper plans are searched for.
    price : returns the true cost of a point of the program, given the program's own estimate,
        and what better faces than the chosen ones spare of it (at most 0).
    source : source of cuts, if any.
    mirrors : symmetries that keep the arrivals; of mirrored children one is searched.

    Attributes
    ----------
    upper : cost of the best plans so far.
    leaf_bound : lower bound on the leaves, where the relaxation is exact; infinite without leaves.
    failed : whether a linear program could not be solved.
    rejected : whether the point of a leaf was no plan.
    """

    def __init__(
        self,
        make: Callable[[], FixedProgram],
        spent: float,
        upper: float,
        budget: Budget,
        price: Callable[[FixedProgram, np.ndarray, float, float], float],
        source: CutSource | None = None,
        mirrors: Sequence[Symmetry] = (),
    ) -> None:
        self.upper, self._spent, self.leaf_bound = upper, spent, inf
        self._make, self._budget, self._price = make, budget, price
        self._source, self._mirrors = source, mirrors
        self._open: list[tuple[float, int, Choice]] = [(-inf, 0, ())]
        self._plunge_nodes: list[tuple[float, Choice]] = []
        self._plunge_limit = -inf
        self._pushed = 0
        self._root_solved = self._cuts_added = False
        self.failed = self.rejected = False
        self._relaxation: Relaxation | None = None

    @property
    def open_bound(self) -> float:
        """Lowest bound of the open nodes; infinite if none is left."""
        least = self._open[0][0] if self._open else inf
        return least if least < self._cutoff else inf

    @property
    def bound(self) -> float:
        """Lower bound on the cost of these arrivals, or ``upper`` if that is less."""
        return min(self.upper, self.leaf_bound, self.open_bound)

    @property
    def root_pending(self) -> bool:
        """Whether the root was not solved yet, or not with the cuts that are due."""
        due = not self._cuts_added and self._source is not None and self._source.due
        return due or not self._root_solved

    def process_root(self) -> None:
        """Add the cuts that are due, and solve the root if it is the only open node."""
        lp = self._lp
        if self._source is not None and self._source.due and not self._cuts_added:
            self._cuts_added = True
            self._add_cuts(lp)
        self._root_solved = True
        if len(self._open) == 1 and not self._open[0][2]:
            lp.set_faces(())
            if (solution := lp.solve(self._cutoff)) is not None:
                self._open = [(solution[0], 0, ())]

    def search(self, upper: float, *, until: float = inf, pause: float = inf) -> bool:
        """Search below ``upper`` until the bound exceeds ``until``; return whether it completed.

        The search also returns once the budget has counted ``pause`` linear programs.  The limits
        of the budget, or a linear program that cannot be solved, interrupt it.
        """
        self.upper = min(self.upper, upper)
        while self._plunge_nodes or (self._open and self._open[0][0] <= until):
            if self.root_pending:
                self.process_root()
            if not self._plunge_nodes and not self._open:
                break
            completed = self._plunge(*self._select_node())
            if not completed or self._budget.used >= pause:
                for bound, choice in self._plunge_nodes:
                    self._push(bound, choice)
                self._plunge_nodes = []
                return completed
        return True

    def release(self) -> None:
        """Free the memory of the linear program; bounds and open nodes stay."""
        self._relaxation = None

    def _select_node(self) -> tuple[float, Choice]:
        """Return the last node of the current plunge, or else the one with the lowest bound."""
        if self._plunge_nodes:
            return self._plunge_nodes.pop()
        bound, _, choice = heapq.heappop(self._open)
        self._plunge_limit = bound + (BAND * (self.upper - bound) if self.upper < inf else 0.0)
        return bound, choice

    def _plunge(self, bound: float, choice: Choice) -> bool:
        """Descend from a node to a leaf or a dead end; return whether it was not interrupted."""
        while bound < self._cutoff:
            if self._budget.out:
                self._push(bound, choice)
                return False
            self._lp.set_faces(choice)
            solution = self._lp.solve(self._cutoff)
            if solution is None:  # the back end failed: the bound of the parent still holds
                self.failed = True
                self._push(bound, choice)
                return False
            value, point = solution
            if value >= self._cutoff:
                return True
            branch = self._branch(value, point)
            if branch is None:
                self.leaf_bound = min(self.leaf_bound, value)
                return True
            *later, (bound, choice) = children(self._lp, self._mirrors, choice, *branch, value)
            for least, other in later:
                if least <= self._plunge_limit:
                    self._plunge_nodes.append((least, other))
                else:
                    self._push(least, other)
        return True

    def _push(self, bound: float, choice: Choice) -> None:
        if bound < self._cutoff:
            self._pushed += 1
            heapq.heappush(self._open, (bound, -self._pushed, choice))

    @property
    def _lp(self) -> Relaxation:
        """The linear program, built when it is needed."""
        if self._relaxation is None:
            self._relaxation = Relaxation(self._make(), self._spent, self._budget)
            if self._cuts_added:
                self._add_cuts(self._relaxation)
        return self._relaxation

    @property
    def _cutoff(self) -> float:
        return self.upper - tol.MIP_GAP

    def _add_cuts(self, lp: Relaxation) -> None:
        for cut in self._source.cuts() if self._source is not None else ():
            if cut.least == inf:  # these arrivals are infeasible
                self._open, self._plunge_nodes = [], []
                return
            lp.add_cut(cut.encounters, cut.least)

    def _branch(self, value: float, point: np.ndarray) -> tuple[int, np.ndarray] | None:
        """Return the disjunction to branch on and its margins; None if ``value`` is exact.

        The plans of ``point`` are priced if they may improve the incumbent.
        """
        lp = self._lp
        if not lp.program.disjunctions:
            self._price_point(point, value, 0.0, leaf=True)
            return None
        errors = relaxation_errors(lp, point)
        leaf = errors.total <= tol.REFINEMENT / 2
        if value + errors.total < self.upper:
            self._price_point(point, value + errors.total, errors.spare, leaf)
        if leaf:
            return None
        k = select_disjunction(lp, errors)
        first = lp.faces.first[k]
        return k, errors.margins[first : first + len(lp.program.disjunctions[k].faces)]

    def _price_point(self, point: np.ndarray, estimate: float, spare: float, leaf: bool) -> None:
        """Price the plans of a point; by the linear program they cost ``estimate + spare``."""
        cost = self._price(self._lp.program, point, estimate, spare)
        self.upper = min(self.upper, cost)
        self.rejected |= leaf and cost == inf
