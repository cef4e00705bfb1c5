r"""Branching over faces, only where the relaxation is wrong.

A node has chosen faces for some disjunctions (an encounter at a time); elsewhere margins are free.
 Its linear program is a lower bound, and its means are plans that can be priced, so every node may
improve the plans in hand.  The disjunction whose true loss exceeds the program's the most is
branched
on, a child per face, the face that the means keep clear of first.  One disjunction's choice moves
the means away at its neighbours too, so that few disjunctions have to be decided at all.

The search dives: the next linear program (:mod:`solvers.engine.node_lp`) then differs by a row or
two.  At the end of a dive it goes on at the lowest bound.  Trees that grow ask for cuts, lower
bounds on what some encounters cost together, and go on with them as rows.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game import objective
from solvers.budget import Budget
from solvers.engine.fixed_arrival_lp import INF, Disjunction, FixedProgram
from solvers.engine.node_lp import Choice, Relaxation
from solvers.engine.symmetry import Symmetry

BAND = 0.1
"""Nodes this near to the lowest bound, as a share of the gap, are searched depth first: they
would come up anyway, and linear programs that differ little are solved faster."""


@dataclass(frozen=True)
class Cut:
    """What the ``encounters`` cost together, weighted, is at least ``least`` for these arrivals."""

    encounters: tuple[int, ...]
    least: float


class CutSource(Protocol):
    """Where a tree's cuts come from."""

    @property
    def due(self) -> bool:
        """Whether it is time to take them up: they have a price."""

    def cuts(self) -> Iterable[Cut]:
        """All of them."""


class Tree:
    """The search for fixed arrivals, below a cost that is known already.

    Nodes wait with their bounds, and the search goes from the lowest straight down to plans; so
    few nodes are seen that plans in hand could have spared.

    Parameters
    ----------
    make, spent : the program that is searched, built when needed, and what its arrivals cost.
    upper : cost of the best plans known; only cheaper ones are looked for.
    price : what a point of the program really costs, given the program's own estimate of it.
    source : of cuts, if there are any.
    mirrors : symmetries that keep the program as it is; of mirrored children one is enough.

    Attributes
    ----------
    upper : cost of the best plans known by now.
    closed : lower bound on what was searched and found not to be dearer, infinite if nothing was.
    """

    def __init__(
        self,
        make: Callable[[], FixedProgram],
        spent: float,
        upper: float,
        budget: Budget,
        price: Callable[[FixedProgram, np.ndarray, float], float],
        source: CutSource | None = None,
        mirrors: Sequence[Symmetry] = (),
    ) -> None:
        self.upper, self._spent, self.closed = upper, spent, INF
        self._make, self._budget, self._price = make, budget, price
        self._source, self._mirrors = source, mirrors
        self._open: list[tuple[float, int, Choice]] = [(-INF, 0, ())]
        self._next: list[tuple[float, Choice]] = []
        self._near = -INF
        self._nodes = 0
        self._looked = self._informed = False
        self._held: Relaxation | None = None

    @property
    def waiting(self) -> float:
        """Lowest bound of what is left to search; infinite if nothing is."""
        least = self._open[0][0] if self._open else INF
        return least if least < self._cutoff else INF

    @property
    def bound(self) -> float:
        """Lower bound on what these arrivals cost, or ``upper`` if that is less."""
        return min(self.upper, self.closed, self.waiting)

    @property
    def behind(self) -> bool:
        """Whether the root was not solved yet, or not with the cuts that are due."""
        due = not self._informed and self._source is not None and self._source.due
        return due or not self._looked

    def look(self) -> None:
        """Take up cuts that are due; the root, if it is all there is, is solved with them."""
        lp = self._lp
        if self._source is not None and self._source.due and not self._informed:
            self._informed = True
            self._learn(lp)
        self._looked = True
        if len(self._open) == 1 and not self._open[0][2]:
            lp.switch(())
            if (answer := lp.solve(self._cutoff)) is not None:
                self._open = [(answer[0], 0, ())]

    def search(self, upper: float, *, until: float = INF) -> bool:
        """Search below ``upper`` until the bound is above ``until``; whether nothing stopped it.

        What stops it is the budget, or a linear program that cannot be solved.
        """
        self.upper = min(self.upper, upper)
        while self._next or (self._open and self._open[0][0] <= until):
            if self.behind:
                self.look()
            if not self._next and not self._open:
                break
            if not self._plunge(*self._take()):
                for bound, choice in self._next:
                    self._wait(bound, choice)
                self._next = []
                return False
        return True

    def _take(self) -> tuple[float, Choice]:
        """The node that waits next to the last one, or else the one with the lowest bound."""
        if self._next:
            return self._next.pop()
        bound, _, choice = heapq.heappop(self._open)
        self._near = bound + (BAND * (self.upper - bound) if self.upper < INF else 0.0)
        return bound, choice

    def rest(self) -> None:
        """Give the memory back; what was proved stays."""
        self._held = None

    def _plunge(self, bound: float, choice: Choice) -> bool:
        """Go down from a node to plans or a dead end; whether nothing stopped it."""
        while bound < self._cutoff:
            if self._budget.out:
                self._wait(bound, choice)
                return False
            self._lp.switch(choice)
            answer = self._lp.solve(self._cutoff)
            if answer is None:  # the back end gave up: what the parent proved still holds
                self._wait(bound, choice)
                return False
            value, point = answer
            if value >= self._cutoff:
                return True
            branch = self._branch(value, point)
            if branch is None:
                self.closed = min(self.closed, value)
                return True
            *later, (bound, choice) = self._children(choice, *branch, value)
            for least, other in later:
                if least <= self._near:
                    self._next.append((least, other))
                else:
                    self._wait(least, other)
        return True

    def _wait(self, bound: float, choice: Choice) -> None:
        if bound < self._cutoff:
            self._nodes += 1
            heapq.heappush(self._open, (bound, -self._nodes, choice))

    @property
    def _lp(self) -> Relaxation:
        """The linear program, built when it is needed."""
        if self._held is None:
            self._held = Relaxation(self._make(), self._spent, self._budget)
            if self._informed:
                self._learn(self._held)
        return self._held

    @property
    def _cutoff(self) -> float:
        return self.upper - tol.MIP_GAP

    def _learn(self, lp: Relaxation) -> None:
        """Add the cuts as rows."""
        for cut in self._source.cuts() if self._source is not None else ():
            if cut.least == INF:
                self._open, self._next = [], []
                return
            lp.learn(cut.encounters, cut.least)

    def _branch(self, value: float, point: np.ndarray) -> tuple[int, np.ndarray] | None:
        """Return the disjunction to branch on and its margins; None if ``value`` is exact."""
        program, faces = self._lp.program, self._lp.faces
        if not program.disjunctions:
            self.upper = min(self.upper, self._price(program, point, value))
            return None
        margins = faces.margins(point)
        best = np.minimum(np.maximum.reduceat(margins, faces.first), faces.caps)
        losses = objective.loss(program.game, np.maximum(best, 0.0)) - point[faces.losses]
        gaps = np.where(best >= 0, faces.weights * losses, INF)
        gaps[self._lp.on] = 0.0
        error = float(np.maximum(gaps, 0.0).sum())
        if value + error < self.upper:
            self.upper = min(self.upper, self._price(program, point, value + error))
        if error <= tol.REFINEMENT / 2:
            return None
        overlap = np.flatnonzero(np.isinf(gaps))
        k = self._first_overlap(overlap, best) if len(overlap) else int(gaps.argmax())
        return k, margins[faces.first[k] : faces.first[k] + len(program.disjunctions[k].faces)]

    def _first_overlap(self, overlap: np.ndarray, best: np.ndarray) -> int:
        """Which of the disjunctions at which bodies overlap to decide first.

        A lone mover finds its gap in the crowd soonest if it is told where to be half-way; of
        several movers the slightest overlap says most clearly on which side they pass.  (Both
        were measured against picking by depth, time or crowding.)
        """
        arrivals = self._lp.program.arrivals
        if len(arrivals) > 1:
            return int(overlap[best[overlap].argmax()])
        times = self._lp.faces.times[overlap]
        middle = np.minimum(times, max(arrivals.values()) - times)
        amid = overlap[middle == middle.max()]
        return int(amid[best[amid].argmin()])

    def _children(
        self, choice: Choice, k: int, margins: np.ndarray, value: float
    ) -> list[tuple[float, Choice]]:
        """A child per face of disjunction k, with a bound on its value, the likeliest last."""
        faces, disjunction = self._lp.faces, self._lp.program.disjunctions[k]
        # The program let this disjunction's loss be as small as it may; a face makes it dearer.
        dearer = np.maximum(faces.least[k] - faces.lowest[k], 0.0)
        bounds = value + self._lp.price(disjunction) * dearer
        order = margins.argsort(kind="stable").tolist()
        if len(self._mirrors) > 1:
            order = self._distinct(choice, disjunction, order)
        return [(float(bounds[p]), (*choice, (k, p))) for p in order]

    def _distinct(self, choice: Choice, disjunction: Disjunction, order: list[int]) -> list[int]:
        """One face of each orbit under the symmetries that keep the choices made so far."""
        made = {self._lp.program.named(k, p) for k, p in choice}
        keeping = [
            one
            for one in self._mirrors
            if {(one.encounters[e], t, one.faces[e][p]) for e, t, p in made} == made
            and one.encounters[disjunction.encounter] == disjunction.encounter
        ]
        kept: dict[int, int] = {}
        for p in order:  # the likeliest comes last and stays
            face = disjunction.faces[p].index
            kept[min(one.faces[disjunction.encounter][face] for one in keeping)] = p
        return [p for p in order if p in kept.values()]
