r"""Cuts: the exact least loss of a few movers among each other, for given arrivals.

A part is a set of encounters: with more than three movers, those among three of them; with two or
three movers, those of each with the obstacles.  Its value is the least loss that its movers can
have in it when all other encounters are left out, which bounds their part of the losses of any
plan.  (Pairs are too weak: two agents pass each other cheaply, three do not.)

Values are found by searches of their own, once for all arrival vectors and symmetric parts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import inf

import numpy as np

from solvers.budget import Budget
from solvers.engine.branch_and_bound import BranchAndBound, Cut
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.presolve import PresolvedEncounter, Subproblem, presolve_encounters
from solvers.engine.symmetry import Symmetry

PATIENCE = 500
"""Linear programs after which a search adds cuts."""

MOST_NODES = 3000
"""Linear programs for one part: the bound that is proved by then is a cut, too."""

SLACK = 1e-9
"""Values are lowered by this, relative above 1, to allow for the back end's tolerance."""

Part = tuple[int, ...]
"""Encounters, ascending."""

PartArrivals = tuple[tuple[int, int], ...]
"""Pairs (agent, arrival), ascending."""


class CutPool:
    """Values of the parts of one subproblem, computed on demand."""

    def __init__(
        self, subproblem: Subproblem, symmetries: Sequence[Symmetry], budget: Budget
    ) -> None:
        self._subproblem, self._symmetries, self._budget = (
            losses_alone(subproblem),
            symmetries,
            budget,
        )
        self._used_before, self._used_by_cuts = budget.used, 0
        self._values: dict[tuple[Part, PartArrivals], float] = {}
        self.parts = _triples(subproblem) or _obstacle_parts(subproblem)

    @property
    def due(self) -> bool:
        """Whether the search has cost enough to pay for cuts."""
        work = self._budget.used - self._used_before - self._used_by_cuts
        return bool(self.parts) and work >= PATIENCE

    def value(self, part: Part, arrivals: Mapping[int, int]) -> float:
        """Return a lower bound on the weighted losses of ``part``, exact up to the node limit."""
        key = min(self._image(symmetry, part, arrivals) for symmetry in self._symmetries)
        if key not in self._values:
            self._values[key] = self._solved(key[0], dict(key[1]))
        return self._values[key]

    def _image(
        self, symmetry: Symmetry, part: Part, arrivals: Mapping[int, int]
    ) -> tuple[Part, PartArrivals]:
        """Return the part and its arrivals under a symmetry."""
        encounters = self._subproblem.game.encounters
        movers = {i for e in part for i in encounters[e].agents if i in arrivals}
        return (
            tuple(sorted(symmetry.encounters[e] for e in part)),
            tuple(sorted((symmetry.agents[i], arrivals[i]) for i in movers)),
        )

    def _solved(self, part: Part, arrivals: dict[int, int]) -> float:
        presolved = presolve_encounters(self._subproblem, part, arrivals)
        if presolved is None:
            return inf

        child = self._budget.child(MOST_NODES)
        bound = bound_of_losses(self._subproblem, arrivals, presolved, inf, child)
        self._budget.charge(child)
        self._used_by_cuts += child.used
        return bound


@dataclass(frozen=True)
class CutsAtArrivals:
    """The cuts for one arrival vector."""

    pool: CutPool
    arrivals: Mapping[int, int]

    @property
    def due(self) -> bool:
        """Whether the search has cost enough to pay for cuts."""
        return self.pool.due

    def cuts(self) -> Iterator[Cut]:
        """Yield one cut per part."""
        for part in self.pool.parts:
            yield Cut(part, self.pool.value(part, self.arrivals))


def bound_of_losses(
    subproblem: Subproblem,
    arrivals: Mapping[int, int],
    presolved: Sequence[PresolvedEncounter],
    upper: float,
    budget: Budget,
) -> float:
    """Return a lower bound on the weighted losses of presolved encounters, at most ``upper``."""

    def make() -> FixedProgram:
        return FixedProgram(subproblem, arrivals, presolved)

    tree = BranchAndBound(make, 0.0, upper, budget, _estimate)
    tree.search(upper)
    return tree.bound - SLACK * max(1.0, tree.bound) if np.isfinite(tree.bound) else tree.bound


def _estimate(program: FixedProgram, point: np.ndarray, estimate: float, spare: float) -> float:
    """Return the LP value: a partial profile cannot be evaluated."""
    return estimate


def losses_alone(subproblem: Subproblem) -> Subproblem:
    """Return the subproblem without efforts: cuts are bounds on losses alone."""
    losses = replace(subproblem.objective, effort=np.zeros(len(subproblem.game.agents)))
    return Subproblem(losses, subproblem.movers, subproblem.given)


def _weighted_encounters(subproblem: Subproblem) -> list[int]:
    return [e for e in subproblem.encounters if subproblem.objective.encounter[e] > 0]


def _obstacle_parts(subproblem: Subproblem) -> list[Part]:
    """Return each mover's weighted encounters with obstacles, if there are several movers."""
    if len(subproblem.movers) < 2:
        return []
    encounters = subproblem.game.encounters
    fixed = [e for e in _weighted_encounters(subproblem) if encounters[e].obstacle is not None]
    groups = (tuple(e for e in fixed if encounters[e].agents == (i,)) for i in subproblem.movers)
    return [part for part in groups if part]


def _triples(subproblem: Subproblem) -> list[Part]:
    """Return the weighted encounters among every three movers, if there are more than three."""
    if len(subproblem.movers) <= 3:
        return []
    weighted = _weighted_encounters(subproblem)
    agents = {e: set(subproblem.game.encounters[e].agents) for e in weighted}
    groups = [set(group) for group in combinations(subproblem.movers, 3)]
    return [tuple(e for e in weighted if agents[e] <= group) for group in groups]
