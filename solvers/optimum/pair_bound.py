r"""Lower bounds for many agents, from exact values of pairs.

Left alone, two agents that arrive at T_i and T_j cost each other at least m_e(T_i, T_j)
(:mod:`solvers.engine.cuts`), so that

    J  >=  min over T of  sum_i tau_i T_i + sum_e m_e(T_i, T_j),

a choice of one arrival per agent under costs of pairs.  Its linear relaxation (one weight per
arrival and per pair of arrivals, with equal marginals) shares every agent's time out among its
pairs in the best way, and is a bound itself; the integer program then is a better one.

Values count as zero until they are needed, and arrivals far beyond the earliest are one state
that costs its time alone: both only lower the bound.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, OptimizeResult, milp
from scipy.sparse import coo_array

from ppg_env.game.objective import Objective
from ppg_env.game.reachability import earliest_arrival
from solvers.budget import Budget
from solvers.engine.cuts import CutPool
from solvers.engine.presolve import Subproblem
from solvers.engine.symmetry import symmetries

STATES = 6
"""Arrivals told apart per agent: so many less one, and `later`."""

PATIENCE = 60.0
"""Most seconds for one integer program; its own bound counts."""


def pair_bound(
    objective: Objective, budget: Budget, progress: Callable[[float], None] | None = None
) -> float:
    """Lower bound on the weighted cost of any feasible profile; -inf if a goal is out of reach.

    ``progress`` is called with every better bound.
    """
    return _Pairs(objective, budget).solve(progress or (lambda bound: None))


class _Pairs:
    """The choice of arrivals, and the pair values known so far."""

    def __init__(self, objective: Objective, budget: Budget) -> None:
        game = objective.game
        everybody = tuple(range(len(game.agents)))
        subproblem = Subproblem(objective, everybody, {})
        self._game, self._objective, self._budget = game, objective, budget
        self._cuts = CutPool(subproblem, symmetries(objective), budget)
        self._first = [earliest_arrival(agent, game.horizon) for agent in game.agents]
        self._edges = [e for e in subproblem.encounters if objective.encounter[e] > 0]
        self._known: dict[tuple[int, tuple[int, ...]], float] = {}

    def solve(self, progress: Callable[[float], None]) -> float:
        if any(first is None for first in self._first):
            return -np.inf
        best = -np.inf
        for whole in (False, True):
            while True:
                found = self._choose(whole)
                if found is None:
                    return best
                bound, wanted = found
                if bound > best:
                    best = bound
                    progress(best)
                missing = [one for one in wanted if one not in self._known]
                if not missing:
                    break
                for e, states in missing:
                    if self._budget.out:
                        return best
                    self._known[e, states] = self._value(e, states)
        return best

    def _time(self, i: int, state: int) -> int:
        return min(int(self._first[i] or 0) + state, self._game.horizon)

    def _value(self, e: int, states: tuple[int, ...]) -> float:
        agents = self._game.encounters[e].agents
        if STATES - 1 in states:
            return 0.0
        arrivals = {i: self._time(i, s) for i, s in zip(agents, states, strict=True)}
        value = self._cuts.value((e,), arrivals)
        return FORBIDDEN if value == np.inf else max(value, 0.0)

    def _choose(self, whole: bool) -> tuple[float, list[tuple[int, tuple[int, ...]]]] | None:
        """The bound with what is known, and the pairs of states that it is made of."""
        count = len(self._game.agents) * STATES
        costs = [
            float(self._objective.time[i]) * self._time(i, s)
            for i, s in product(range(len(self._game.agents)), range(STATES))
        ]
        rows, columns = list[int](), list[int]()
        values, right = list[float](), list[float]()

        def row(terms: list[tuple[int, float]], value: float) -> None:
            rows.extend([len(right)] * len(terms))
            columns.extend(c for c, _ in terms)
            values.extend(v for _, v in terms)
            right.append(value)

        for i in range(len(self._game.agents)):
            row([(i * STATES + s, 1.0) for s in range(STATES)], 1.0)
        names = [(e, states) for e in self._edges for states in self._states(e)]
        places = {name: count + n for n, name in enumerate(names)}
        costs += [self._known.get(name, 0.0) for name in names]
        for e in self._edges:
            for k, i in enumerate(self._game.encounters[e].agents):
                for s in range(STATES):
                    mine = [(places[e, st], 1.0) for st in self._states(e) if st[k] == s]
                    row([*mine, (i * STATES + s, -1.0)], 0.0)
        matrix = coo_array((values, (rows, columns)), shape=(len(right), len(costs)))
        seconds = PATIENCE if self._budget.left is None else min(PATIENCE, self._budget.left)
        answer: OptimizeResult = milp(
            np.array(costs),
            integrality=np.concatenate(
                [np.full(count, int(whole)), np.zeros(len(names), dtype=int)]
            ),
            bounds=Bounds(0, 1),
            constraints=LinearConstraint(matrix.tocsc(), right, right),
            options={"time_limit": max(seconds, 0.01)},
        )
        bound = answer.mip_dual_bound if whole else answer.fun
        if bound is None or answer.x is None:
            return None
        used = [name for name, place in places.items() if answer.x[place] > 1e-6]
        return float(bound) - 1e-7 * max(1.0, abs(float(bound))), used

    def _states(self, e: int) -> list[tuple[int, ...]]:
        return list(product(range(STATES), repeat=len(self._game.encounters[e].agents)))


FORBIDDEN = 1e4
"""What a pair of arrivals costs that no plans keep apart."""
