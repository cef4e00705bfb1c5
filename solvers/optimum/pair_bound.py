r"""Lower bounds for many agents, from exact values of pairs.

Without other agents, two agents that arrive at T_i and T_j lose at least m_e(T_i, T_j) to each
other (:mod:`solvers.engine.cuts`), so that

    J  >=  min over T of  sum_i tau_i T_i + sum_e m_e(T_i, T_j),

a choice of one arrival per agent under costs of pairs.  Its linear relaxation (one weight per
arrival and per pair of arrivals, with equal marginals) divides every agent's time optimally among
its pairs, and is a bound itself; the integer program is a better one.

Where pairs are settled, cores of more agents (:mod:`solvers.optimum.cores`) add their losses, as
long as time lasts.

Values count as zero until they are needed, and arrivals far beyond the earliest are one state
that costs its time alone: both only lower the bound.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, OptimizeResult, milp
from scipy.sparse import coo_array

from ppg_env.game.earliest_way import earliest_way
from ppg_env.game.objective import Objective
from solvers.budget import Budget
from solvers.engine.cuts import CutPool
from solvers.engine.presolve import Subproblem
from solvers.engine.symmetry import symmetries
from solvers.optimum.cores import Core, CoreSearch

STATES = 6
"""Arrivals that are distinguished per agent: STATES - 1, and `later`."""

PATIENCE = 60.0
"""Largest number of seconds for one integer program; its own bound counts."""

FORBIDDEN = 1e4
"""Cost of a pair of arrivals for which the bodies cannot keep apart."""

PairStates = tuple[int, tuple[int, ...]]
"""An encounter and the states of its agents."""


def pair_bound(
    objective: Objective, budget: Budget, on_progress: Callable[[float], None] | None = None
) -> float:
    """Return a lower bound on ``objective`` over all feasible profiles.

    The bound is -inf if a goal cannot be reached.  ``on_progress`` is called with every better
    bound.
    """
    return _PairProgram(objective, budget).solve(on_progress or (lambda bound: None))


class _PairProgram:
    """The choice of arrivals, and the pair values computed so far."""

    def __init__(self, objective: Objective, budget: Budget) -> None:
        self._game, self._objective, self._budget = objective.game, objective, budget
        agents = tuple(range(len(self._game.agents)))
        subproblem, images = Subproblem(objective, agents, {}), symmetries(objective)
        self._cuts = CutPool(subproblem, images, budget)
        self._first = [earliest_way(self._game, i) for i in agents]
        self._edges = [e for e in subproblem.encounters if objective.encounter[e] > 0]
        self._values: dict[PairStates, float] = {}
        self._excess: dict[int, float] = {}
        first, last = ([self._time(i, s) for i in agents] for s in (0, STATES - 1))
        self._search = CoreSearch(objective, images, first, last, budget)
        self._cores: set[Core] = set()

    def solve(self, on_progress: Callable[[float], None]) -> float:
        """Return the bound of the relaxation, then of the integer program, within the budget."""
        if any(first is None for first in self._first):
            return -np.inf
        best = -np.inf
        for integral in (False, True):
            while True:
                solution = self._choose(integral)
                if solution is None:
                    return best
                bound, used = solution
                if bound > best:
                    best = bound
                    on_progress(best)
                missing = [pair for pair in used if pair not in self._values]
                if not missing and not (integral and self._add_cores(used)):
                    break
                for pair in missing:
                    if self._budget.out:
                        return best
                    self._values[pair] = self._value(*pair)
        return best

    def _add_cores(self, used: list[PairStates]) -> bool:
        """Add the cores that the pairs of states in a solution violate; return whether any is."""
        encounters, arrivals = self._game.encounters, [t or 0 for t in self._first]
        for e, states in used:
            for i, state in zip(encounters[e].agents, states, strict=True):
                arrivals[i] = self._time(i, state)
        losses = {e: self._values[e, states] + self._excess.get(e, 0.0) for e, states in used}
        cores = self._search.violated(arrivals, losses) - self._cores
        self._cores |= cores
        return bool(cores)

    def _time(self, i: int, state: int) -> int:
        """Return the arrival of agent i in a state."""
        return min(int(self._first[i] or 0) + state, self._game.horizon)

    def _value(self, e: int, states: tuple[int, ...]) -> float:
        """Return the least weighted loss of encounter e in the states of its agents."""
        agents = self._game.encounters[e].agents
        if STATES - 1 in states:
            return 0.0
        arrivals = {i: self._time(i, s) for i, s in zip(agents, states, strict=True)}
        value = self._cuts.value((e,), arrivals)
        return FORBIDDEN if value == np.inf else max(value, 0.0)

    def _choose(self, integral: bool) -> tuple[float, list[PairStates]] | None:
        """Return the bound for the values so far, and the pairs of states in its solution."""
        agents = range(len(self._game.agents))
        count = len(agents) * STATES
        pairs = [(e, states) for e in self._edges for states in self._states(e)]
        columns = {pair: count + n for n, pair in enumerate(pairs)}
        costs = [
            float(self._objective.time[i]) * self._time(i, s)
            for i, s in product(agents, range(STATES))
        ]
        costs += [self._values.get(pair, 0.0) for pair in pairs] + [1.0] * len(self._edges)
        seconds = PATIENCE if self._budget.left is None else min(PATIENCE, self._budget.left)
        answer: OptimizeResult = milp(
            np.array(costs),
            integrality=np.repeat([int(integral), 0], [count, len(costs) - count]),
            bounds=Bounds(0, np.repeat([1, np.inf], [count + len(pairs), len(self._edges)])),
            constraints=self._constraints(columns),
            options={"time_limit": max(seconds, 0.01)},
        )
        bound = answer.mip_dual_bound if integral else answer.fun
        if bound is None or answer.x is None:
            return None
        self._excess = dict(zip(self._edges, answer.x[count + len(pairs) :], strict=True))
        used = [pair for pair, column in columns.items() if answer.x[column] > 1e-6]
        return float(bound) - 1e-7 * max(1.0, abs(float(bound))), used

    def _constraints(self, columns: dict[PairStates, int]) -> LinearConstraint:
        """Return that agents are in one state, pairs have equal marginals, and what cores lose."""
        agents = range(len(self._game.agents))
        rows = [([(i * STATES + s, 1.0) for s in range(STATES)], 1.0, 1.0) for i in agents]
        for e in self._edges:
            for k, i in enumerate(self._game.encounters[e].agents):
                for s in range(STATES):
                    marginal = [(columns[e, st], 1.0) for st in self._states(e) if st[k] == s]
                    rows.append(([*marginal, (i * STATES + s, -1.0)], 0.0, 0.0))
        rows += [(self._core_row(core, columns), core.least, np.inf) for core in self._cores]
        entries = [(n, column, v) for n, (row, *_) in enumerate(rows) for column, v in row]
        numbers, places, values = zip(*entries, strict=True)
        shape = len(rows), len(agents) * STATES + len(columns) + len(self._edges)
        matrix = coo_array((values, (numbers, places)), shape=shape)
        return LinearConstraint(matrix.tocsc(), *np.array([row[1:] for row in rows]).T)

    def _core_row(self, core: Core, columns: dict[PairStates, int]) -> list[tuple[int, float]]:
        """Return the row of a core: its losses, and its agents that arrive later."""
        group = {i for i, _ in core.latest}
        row = [
            (i * STATES + s, core.least)
            for i, latest in core.latest
            for s in range(STATES)
            if self._time(i, s) > latest or s == STATES - 1
        ]
        first_excess = len(self._game.agents) * STATES + len(columns)
        for n, e in enumerate(self._edges):
            if group.issuperset(self._game.encounters[e].agents):
                row.append((first_excess + n, 1.0))
                for states in self._states(e):
                    value = min(self._values.get((e, states), 0.0), core.least)
                    row.append((columns[e, states], value))
        return row

    def _states(self, e: int) -> list[tuple[int, ...]]:
        return list(product(range(STATES), repeat=len(self._game.encounters[e].agents)))
