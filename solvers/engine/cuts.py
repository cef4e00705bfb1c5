r"""Cuts: what a few movers cost each other at least, exactly, when their arrivals are given.

A part is a set of encounters: with more than three movers, those among three of them; with two or
three, what each has with the obstacles.  Its value is the least loss that its movers can have in
it while everybody else is left out.  That bounds their share of any plan's losses.  (Each pair
alone says too little: two agents pass each other cheaply, three do not.)

Values are found by trees of their own, once for all arrival vectors and for all symmetric parts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from solvers.budget import Budget
from solvers.engine.branch_and_bound import Cut, Tree
from solvers.engine.fixed_arrival_lp import INF, FixedProgram
from solvers.engine.presolve import Subproblem, presolve_encounters
from solvers.engine.symmetry import Symmetry

PATIENCE = 500
"""Linear programs after which a search takes up cuts."""

MOST = 3000
"""Linear programs for one part: what is proved by then is a cut, too."""

SLACK = 1e-9
"""Values are lowered by this, relative above 1, for the back end's tolerance."""

Part = tuple[int, ...]
"""Encounters, ascending."""


class CutPool:
    """Values of parts for one subproblem, computed when first asked for."""

    def __init__(
        self, subproblem: Subproblem, symmetries: Sequence[Symmetry], budget: Budget
    ) -> None:
        self._subproblem, self._symmetries, self._budget = subproblem, symmetries, budget
        self._begun, self._spent = budget.used, 0
        self._known: dict[tuple[Part, tuple[tuple[int, int], ...]], float] = {}
        self.parts = _triples(subproblem) or _alone(subproblem)

    @property
    def due(self) -> bool:
        """Whether the search has cost so much by now that cuts are worth their price."""
        work = self._budget.used - self._begun - self._spent
        return bool(self.parts) and work >= PATIENCE

    def value(self, part: Part, arrivals: Mapping[int, int]) -> float:
        """Lower bound on the weighted losses of ``part``, exact up to the tree's limit."""
        part, mine = min(self._moved(one, part, arrivals) for one in self._symmetries)
        if (part, mine) not in self._known:
            self._known[part, mine] = self._solved(part, dict(mine))
        return self._known[part, mine]

    def _moved(
        self, one: Symmetry, part: Part, arrivals: Mapping[int, int]
    ) -> tuple[Part, tuple[tuple[int, int], ...]]:
        encounters = self._subproblem.game.encounters
        movers = {i for e in part for i in encounters[e].agents if i in arrivals}
        return (
            tuple(sorted(one.encounters[e] for e in part)),
            tuple(sorted((one.agents[i], arrivals[i]) for i in movers)),
        )

    def _solved(self, part: Part, arrivals: dict[int, int]) -> float:
        known = presolve_encounters(self._subproblem, part, arrivals)
        if known is None:
            return INF

        def make() -> FixedProgram:
            return FixedProgram(self._subproblem, arrivals, known)

        share = self._budget.child(MOST)
        tree = Tree(make, 0.0, INF, share, _estimate)
        tree.search(INF)
        self._budget.charge(share)
        self._spent += share.used
        return tree.bound - SLACK * max(1.0, tree.bound) if np.isfinite(tree.bound) else tree.bound


@dataclass(frozen=True)
class CutsAtArrivals:
    """The cuts for one arrival vector, as a tree asks for them."""

    known: CutPool
    arrivals: Mapping[int, int]

    @property
    def due(self) -> bool:
        """Whether it is time to take them up."""
        return self.known.due

    def cuts(self) -> Iterator[Cut]:
        """One per part."""
        for part in self.known.parts:
            yield Cut(part, self.known.value(part, self.arrivals))


def _estimate(program: FixedProgram, point: np.ndarray, estimate: float) -> float:
    """A part's plans are nobody's: what counts is what the program thinks of them."""
    return estimate


def _alone(subproblem: Subproblem) -> list[Part]:
    """Each mover's weighty encounters with obstacles, if there are several movers."""
    if len(subproblem.movers) < 2:
        return []
    weighty = [e for e in subproblem.encounters if subproblem.objective.encounter[e] > 0]
    fixed = [e for e in weighty if subproblem.game.encounters[e].obstacle is not None]
    groups = (
        tuple(e for e in fixed if subproblem.game.encounters[e].agents == (i,))
        for i in subproblem.movers
    )
    return [part for part in groups if part]


def _triples(subproblem: Subproblem) -> list[Part]:
    """The weighty encounters among every three movers, if there are more movers than that."""
    if len(subproblem.movers) <= 3:
        return []
    weighty = [e for e in subproblem.encounters if subproblem.objective.encounter[e] > 0]
    who = {e: set(subproblem.game.encounters[e].agents) for e in weighty}
    groups = [set(group) for group in combinations(subproblem.movers, 3)]
    return [tuple(e for e in weighty if who[e] <= group) for group in groups]
