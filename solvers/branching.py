r"""Branching over faces, only where the relaxation is wrong.

A node has chosen faces for some moments (an encounter at a time); elsewhere margins are free.  Its
linear program is a lower bound, and its means are plans that can be priced, so every node may
improve the plans in hand.  The moment whose true loss exceeds the program's the most is branched
on, a child per face, the face that the means keep clear of first.  One moment's choice moves the
means away at its neighbours too, so that few moments have to be decided at all.

The search dives: the next linear program then differs by a row or two, and the simplex method
goes on from where it was.  At the end of a dive it goes on at the lowest bound.  Trees that grow
ask for lemmas, lower bounds on what some encounters cost together, and go on with them as rows.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ppg_env import objective
from ppg_env import tolerances as tol
from solvers.backend import FEASIBILITY
from solvers.clock import Clock
from solvers.fixed import INF, FixedProgram, Moment, tangent
from solvers.symmetry import Symmetry

CURVATURE = 1e-8
"""A tangent is added where the loss is above the program's by more than this, times its weight."""

REFINEMENTS = 30
"""Most rounds of tangents in one node; two or three are usual."""

BAND = 0.1
"""Nodes this near to the lowest bound, as a share of the gap, are searched depth first: they
would come up anyway, and linear programs that differ little are solved faster."""

Choice = tuple[tuple[int, int], ...]
"""Pairs (moment, face) that a node has switched on."""


@dataclass(frozen=True)
class Lemma:
    """What the ``encounters`` cost together, weighted, is at least ``least`` for these arrivals."""

    encounters: tuple[int, ...]
    least: float


class Source(Protocol):
    """Where a tree's lemmas come from."""

    @property
    def due(self) -> bool:
        """Whether it is time to take them up: they have a price."""

    def lemmas(self) -> Iterable[Lemma]:
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
    source : of lemmas, if there are any.
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
        clock: Clock,
        price: Callable[[FixedProgram, np.ndarray, float], float],
        source: Source | None = None,
        mirrors: Sequence[Symmetry] = (),
    ) -> None:
        self.upper, self._spent, self.closed = upper, spent, INF
        self._make, self._clock, self._price = make, clock, price
        self._source, self._mirrors = source, mirrors
        self._open: list[tuple[float, int, Choice]] = [(-INF, 0, ())]
        self._next: list[tuple[float, Choice]] = []
        self._near = -INF
        self._nodes, self._solved = 0, 0
        self._looked = self._informed = False
        self._awake = False

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
        """Whether the root was not solved yet, or not with the lemmas that are due."""
        due = not self._informed and self._source is not None and self._source.due
        return due or not self._looked

    def look(self) -> None:
        """Take up lemmas that are due; the root, if it is all there is, is solved with them."""
        self._wake()
        if self._source is not None and self._source.due and not self._informed:
            self._informed = True
            self._learn()
        self._looked = True
        if len(self._open) == 1 and not self._open[0][2]:
            self._switch(())
            if (answer := self._relaxed()) is not None:
                self._open = [(answer[0], 0, ())]

    def search(self, upper: float, *, until: float = INF, limit: int | None = None) -> bool:
        """Search below ``upper`` until the bound is above ``until``; whether nothing stopped it.

        ``limit`` is a number of linear programs.  What stops it may also be the clock.
        """
        self.upper = min(self.upper, upper)
        self._wake()
        while self._next or (self._open and self._open[0][0] <= until):
            if self.behind:
                self.look()
            if not self._next and not self._open:
                break
            if not self._plunge(*self._take(), limit):
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

    def settle(self, means: Sequence[np.ndarray]) -> np.ndarray | None:
        """The best point with the faces that count for ``means``, if there is one."""
        self._wake()
        margins = self._faces.margins(self._program.point(means))
        best = [part.argmax() for part in np.split(margins, self._faces.first[1:])]
        self._switch(tuple((k, int(p)) for k, p in enumerate(best) if self._program.moments))
        answer = self._relaxed()
        return None if answer is None or answer[0] == INF else answer[1]

    def rest(self) -> None:
        """Give the memory back; what was proved stays."""
        if self._awake:
            del self._lp, self._program, self._faces
            self._awake = False

    def _plunge(self, bound: float, choice: Choice, limit: int | None) -> bool:
        """Go down from a node to plans or a dead end; whether nothing stopped it."""
        while bound < self._cutoff:
            if self._clock.out or (limit is not None and self._solved >= limit):
                self._wait(bound, choice)
                return False
            self._switch(choice)
            answer = self._relaxed()
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
            *later, (bound, choice) = self._children(choice, *branch, value, point)
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

    def _wake(self) -> None:
        if self._awake:
            return
        import highspy

        self._awake, self._program = True, self._make()
        self._base = self._spent + sum(self._program.settled.values())
        self._optimal = highspy.HighsModelStatus.kOptimal
        self._infeasible = highspy.HighsModelStatus.kInfeasible
        self._lp = highspy.Highs()
        for name, value in OPTIONS.items():
            self._lp.setOptionValue(name, value)
        self._lp.passModel(self._program.model())
        self._first, self._rows = self._lp.getNumRow(), list[tuple[int, int] | None]()
        self._on: list[int] = []
        self._faces = _Faces(self._program.moments)
        if self._informed:
            self._learn()

    @property
    def _cutoff(self) -> float:
        return self.upper - tol.MIP_GAP

    def _learn(self) -> None:
        """Add the lemmas as rows."""
        for lemma in self._source.lemmas() if self._source is not None else ():
            if lemma.least == INF:
                self._open, self._next = [], []
                return
            open_ = [m for m in self._program.moments if m.encounter in lemma.encounters]
            least = lemma.least - sum(self._program.settled.get(e, 0.0) for e in lemma.encounters)
            if open_ and least > tol.MIP_GAP:
                columns = np.array([m.loss for m in open_], dtype=np.int32)
                weights = np.array([m.weight for m in open_])
                self._add(None, least, columns, weights)

    def _switch(self, wanted: Choice) -> None:
        """Let exactly the faces ``wanted`` hold."""
        keep = set(wanted)
        gone = [n for n, made in enumerate(self._rows) if made is not None and made not in keep]
        if gone:
            numbers = np.array(gone, dtype=np.int32) + self._first
            self._lp.deleteRows(len(numbers), numbers)
            self._rows = [made for made in self._rows if made is None or made in keep]
        for made in wanted:
            if made not in self._rows:
                self._add(made, *self._program.row(*made))
        self._on = [k for k, _ in wanted]

    def _add(
        self, made: tuple[int, int] | None, least: float, columns: np.ndarray, values: np.ndarray
    ) -> None:
        """Add a row, for a chosen face or for good."""
        self._lp.addRow(least, INF, len(columns), columns, values)
        self._rows.append(made)

    def _relaxed(self) -> tuple[float, np.ndarray] | None:
        """Value and point of the node's program, with all tangents that matter there.

        The value is infinite if the program has no solution; None if the back end gives up.
        """
        for _ in range(REFINEMENTS):
            self._solved += 1
            self._clock.tick()
            status = self._run()
            if status == self._infeasible:
                return INF, np.zeros(0)
            if status != self._optimal:
                return None
            value = self._base + float(self._lp.getInfo().objective_function_value)
            point = np.array(self._lp.getSolution().col_value)
            if value >= self._cutoff or not self._refine(point):
                break
        return value, point

    def _run(self) -> Any:
        """Solve the program as it is; from scratch and with the dual simplex if need be."""
        self._lp.run()
        status = self._lp.getModelStatus()
        if status in (self._optimal, self._infeasible):
            return status
        # The primal simplex method sometimes cannot tell that there is no solution.
        self._lp.clearSolver()
        self._lp.setOptionValue("simplex_strategy", 1)
        self._lp.run()
        self._lp.setOptionValue("simplex_strategy", OPTIONS["simplex_strategy"])
        return self._lp.getModelStatus()

    def _refine(self, point: np.ndarray) -> bool:
        """Add tangents at the margins of chosen faces; whether any was missing."""
        on = [k for k in self._on if self._program.moments[k].margin is not None]
        if not on:
            return False
        margins = np.clip(point[self._faces.margin_columns[on]], 0.0, self._faces.caps[on])
        errors = objective.loss(self._program.game, margins) - point[self._faces.losses[on]]
        missing = False
        for n in np.flatnonzero(errors * self._faces.weights[on] > CURVATURE).tolist():
            if line := tangent(self._program.game, float(margins[n])):
                moment = self._program.moments[on[n]]
                columns = np.array([moment.loss, moment.margin], dtype=np.int32)
                self._add(None, line[1], columns, np.array([1.0, -line[0]]))
                missing = True
        return missing

    def _branch(self, value: float, point: np.ndarray) -> tuple[int, np.ndarray] | None:
        """The moment to decide next, and what its faces give; None if the point costs ``value``."""
        if not self._program.moments:
            self.upper = min(self.upper, self._price(self._program, point, value))
            return None
        faces, margins = self._faces, self._faces.margins(point)
        best = np.minimum(np.maximum.reduceat(margins, faces.first), faces.caps)
        losses = objective.loss(self._program.game, np.maximum(best, 0.0)) - point[faces.losses]
        gaps = faces.weights * np.where(best >= 0, losses, INF)
        gaps[self._on] = 0.0
        error = float(np.maximum(gaps, 0.0).sum())
        if value + error < self.upper:
            price = self._price(self._program, point, value + error)
            self.upper = min(self.upper, price)
        if error <= tol.REFINEMENT / 2:
            return None
        overlap = np.flatnonzero(np.isinf(gaps))
        k = self._first_overlap(overlap, best) if len(overlap) else int(gaps.argmax())
        return k, margins[faces.first[k] : faces.first[k] + len(self._program.moments[k].faces)]

    def _first_overlap(self, overlap: np.ndarray, best: np.ndarray) -> int:
        """Which of the moments at which bodies overlap to decide first.

        A lone mover finds its gap in the crowd soonest if it is told where to be half-way; of
        several movers the slightest overlap says most clearly on which side they pass.  (Both
        were measured against picking by depth, time or crowding.)
        """
        if len(self._program.arrivals) > 1:
            return int(overlap[best[overlap].argmax()])
        times = self._faces.times[overlap]
        middle = np.minimum(times, max(self._program.arrivals.values()) - times)
        amid = overlap[middle == middle.max()]
        return int(amid[best[amid].argmin()])

    def _children(
        self, choice: Choice, k: int, margins: np.ndarray, value: float, point: np.ndarray
    ) -> list[tuple[float, Choice]]:
        """A child per face of moment k, with a bound on its value, the likeliest last."""
        moment = self._program.moments[k]
        # The program let this moment's loss be as small as it may.  A face makes it dearer, and
        # its reduced cost says by how much at least: another loss may shrink in return.
        price = max(self._lp.getSolution().col_dual[moment.loss], 0.0)
        dearer = np.maximum(self._faces.least[k] - self._faces.lowest[k], 0.0)
        bounds = value + price * dearer
        order = margins.argsort(kind="stable").tolist()
        if len(self._mirrors) > 1:
            order = self._distinct(choice, moment, order)
        return [(float(bounds[p]), (*choice, (k, p))) for p in order]

    def _distinct(self, choice: Choice, moment: Moment, order: list[int]) -> list[int]:
        """One face of each orbit under the symmetries that keep the choices made so far."""
        made = {self._program.named(k, p) for k, p in choice}
        keeping = [
            one
            for one in self._mirrors
            if {(one.encounters[e], t, one.faces[e][p]) for e, t, p in made} == made
            and one.encounters[moment.encounter] == moment.encounter
        ]
        kept: dict[int, int] = {}
        for p in order:  # the likeliest comes last and stays
            face = moment.faces[p].index
            kept[min(one.faces[moment.encounter][face] for one in keeping)] = p
        return [p for p in order if p in kept.values()]


class _Faces:
    """All faces of all moments side by side, to price a point at once.

    Attributes
    ----------
    first : (K,) where each moment's faces begin.
    times, caps, weights, margin_columns, losses : (K,) of the moments; the last two are columns.
    lowest : (K,) the least loss of each moment.
    least : per moment, (F,) the least loss that each of its faces allows.
    """

    def __init__(self, moments: Sequence[Moment]) -> None:
        faces = [face for moment in moments for face in moment.faces]
        ends = np.cumsum([len(moment.faces) for moment in moments], dtype=int)
        self.first = ends - [len(moment.faces) for moment in moments]
        self.times = np.array([moment.time for moment in moments], dtype=int)
        self.caps = np.array([moment.cap for moment in moments])
        self.weights = np.array([moment.weight for moment in moments])
        self.margin_columns = np.array([moment.margin or 0 for moment in moments], dtype=int)
        self.losses = np.array([moment.loss for moment in moments], dtype=int)
        self.lowest = np.array([moment.lowest for moment in moments])
        self.least = [np.array([face.least for face in moment.faces]) for moment in moments]
        width = max((len(face.columns) for face in faces), default=0)
        self._columns = np.zeros((len(faces), width), dtype=int)
        self._values = np.zeros((len(faces), width))
        for k, face in enumerate(faces):
            self._columns[k, : len(face.columns)] = face.columns
            self._values[k, : len(face.values)] = face.values
        self._constants = np.array([face.constant for face in faces])
        self._units = np.array([face.unit for face in faces])

    def margins(self, point: np.ndarray) -> np.ndarray:
        """The margin that each face gives the means of ``point``."""
        clear = (self._values * point[self._columns]).sum(axis=1) + self._constants
        # A face without noise counts fully or not at all.
        certain = np.where(clear >= -tol.LENGTH, np.inf, -np.inf)
        return np.divide(clear, self._units, out=certain, where=self._units > 0)


OPTIONS: dict[str, Any] = {
    "output_flag": False,
    "threads": 1,
    "presolve": "off",  # nodes differ by a row or two, and go on from the last basis
    "solver": "simplex",
    "simplex_strategy": 4,  # primal: few steps from node to node, and duals that prune well
    "primal_simplex_bound_perturbation_multiplier": 0.0,
    "primal_feasibility_tolerance": FEASIBILITY,
    "dual_feasibility_tolerance": FEASIBILITY,
}
