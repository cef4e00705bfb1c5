r"""Cores: few agents that lose to each other if all of them arrive early, and cuts from them.

With the least losses m_S(a) of :mod:`solvers.optimum.core_values`,

    sum over pairs e in S of l_e  >=  m_S(a) (1 - number of agents in S that arrive after a).

A cut is lifted: a rises as long as its value stays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from ppg_env.game.objective import Objective
from solvers.budget import Budget
from solvers.engine.symmetry import Symmetry
from solvers.optimum.core_values import CoreValues

SIZES = (3, 4, 5)
"""Numbers of agents in a core, in turn until cuts are found."""

LEAST = 0.4
"""A core is used if it raises losses by this at least, in the mean cost of a time step."""

BATCH = 8
"""Cores that are added at once, symmetric ones aside."""


@dataclass(frozen=True)
class Core:
    """Agents that lose ``least`` to each other if each arrives by its ``latest`` time."""

    latest: tuple[tuple[int, int], ...]
    least: float


class CoreSearch:
    """Search for cores that a choice of arrivals violates.

    Parameters
    ----------
    first : earliest arrival of each agent.
    last : arrival from which an agent is in no core.
    """

    def __init__(
        self,
        objective: Objective,
        symmetries: Sequence[Symmetry],
        first: Sequence[int],
        last: Sequence[int],
        budget: Budget,
    ) -> None:
        self.values = CoreValues(objective, symmetries, first, budget)
        self._symmetries, self._first, self._last = symmetries, first, last

    def violated(self, arrivals: Sequence[int], losses: Mapping[int, float]) -> set[Core]:
        """Return cores that agents with ``arrivals`` and ``losses`` of encounters violate."""
        early = [i for i, t in enumerate(arrivals) if t < self._last[i]]
        early.sort(key=lambda i: arrivals[i] - self._first[i])
        for size in SIZES if self.values.possible else ():
            cores = set[Core]()
            count = 0
            for numbers in sorted(combinations(range(len(early)), size), key=sum):
                if self.values.budget.out or count >= BATCH:
                    break
                core = self._core({early[k]: arrivals[early[k]] for k in numbers}, losses)
                if core is not None:
                    cores |= self._images(core)
                    count += 1
            if cores:
                return cores
        return set()

    def _core(self, latest: dict[int, int], losses: Mapping[int, float]) -> Core | None:
        """Return a core of agents that holds for arrivals as late as possible, if violated."""
        paid = sum(losses.get(e, 0.0) for e in self.values.encounters(latest))
        step, least = self.values.step, self.values.value(latest)
        needed = paid + LEAST * step
        if least < needed:
            return None
        wanted = max(min(least, step), needed)
        raised = True
        while raised:
            raised = False
            for i in latest:
                later = latest | {i: latest[i] + 1}
                if later[i] < self._last[i] and (value := self.values.value(later)) >= wanted:
                    latest, least, raised = later, min(least, value), True
        return Core(tuple(sorted(latest.items())), least)

    def _images(self, core: Core) -> set[Core]:
        """Return the core and those that symmetries map it to."""
        return {
            Core(tuple(sorted((s.agents[i], t) for i, t in core.latest)), core.least)
            for s in self._symmetries
        }
