"""Deviations that are cheap against every plan of a set: best responses to a guard.

The engine's branch and bound finds them, with the clearances of a guard
(:mod:`solvers.extremes.guard`) in place of those of one plan.  Its bounds are not used: the guard
prices every plan that it returns.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.earliest_way import earliest_way
from ppg_env.game.input_sets import excess
from ppg_env.game.objective import selfish
from ppg_env.game.plan import Plan, make_plan
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import workspace_excess
from solvers.budget import Budget
from solvers.engine.branch_and_bound import BranchAndBound
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.presolve import PresolvedEncounter, Subproblem, presolve_within
from solvers.engine.reachability_bounds import reach_of
from solvers.extremes.guard import PAIR, Guard, directions_of

MOST_NODES = 60
"""Linear programs for one deviation with a given arrival: a cheap one is wanted, not the best."""


def guarded_response(guard: Guard, most: float, budget: Budget) -> Plan | None:
    """Return a plan of the guard's agent that costs at most ``most``; None if none is found.

    The earliest arrival that allows one is taken.
    """
    game, i = guard.game, guard.agent
    lam, first = game.agents[i].lam, earliest_way(game, i)
    search = _Search(guard, most)
    for arrival in range(first or 0, game.horizon + 1):
        late = search.least - lam * arrival <= tol.MIP_GAP
        if budget.out or late or search.best is not None:
            break
        search.try_arrival(arrival, budget)
    return search.best


class _Search:
    """The cheapest plan so far, and what it costs."""

    def __init__(self, guard: Guard, most: float) -> None:
        self._guard, self.least = guard, most + tol.MIP_GAP
        self.best: Plan | None = None
        i = guard.agent
        self._subproblem = Subproblem(selfish(guard.game, i), (i,), {1 - i: _nowhere(guard)})

    def try_arrival(self, arrival: int, budget: Budget) -> None:
        """Search the plans that arrive at ``arrival``."""
        guard, game = self._guard, self._guard.game
        presolved = _presolved(guard, arrival)
        if presolved is None:
            return
        arrivals = {guard.agent: arrival}
        child = budget.child(MOST_NODES)
        tree = BranchAndBound(
            lambda: _guarded(FixedProgram(self._subproblem, arrivals, [presolved]), guard),
            game.agents[guard.agent].lam * arrival,
            self.least,
            child,
            self._price,
        )
        tree.search(self.least)
        budget.charge(child)

    def _price(
        self, program: FixedProgram, point: np.ndarray, estimate: float, spare: float
    ) -> float:
        agent = self._guard.game.agents[self._guard.agent]
        plan = make_plan(agent, program.controls_at(point)[self._guard.agent])
        cost = self._guard.cost(plan) if admissible(self._guard, plan) else inf
        if cost < self.least:
            self.best, self.least = plan, cost
        return cost


def admissible(guard: Guard, plan: Plan) -> bool:
    """Return whether a plan arrives and keeps its own constraints."""
    agent, horizon = guard.game.agents[guard.agent], guard.game.horizon
    if plan.arrival is None:
        return False
    beyond = excess(planned_controls(agent, horizon), plan.controls[: plan.arrival])
    outside = workspace_excess(agent, plan.means[: plan.arrival + 1])
    return beyond <= tol.CONTROL * agent.control_unit and outside <= tol.LENGTH * agent.unit


def _presolved(guard: Guard, arrival: int) -> PresolvedEncounter | None:
    """Return the encounter of both agents, with the guard's clearances."""
    game, i = guard.game, guard.agent
    count = min(arrival, len(guard.nearest))
    encounter, toward = game.encounters[PAIR], directions_of(game, i)
    reach = reach_of(game.agents[i], tuple(map(tuple, toward.tolist())), game.horizon)
    low, high = reach.bounds(arrival, count)
    rest = -encounter.collision.offsets - guard.nearest[:count]
    return presolve_within(game, PAIR, (game.horizon,) * 2, rest - high, rest - low)


def _guarded(program: FixedProgram, guard: Guard) -> FixedProgram:
    """Return the program with the clearances that the guard leaves; the other was at zero."""
    program.disjunctions = [
        replace(
            disjunction,
            faces=tuple(
                replace(
                    face,
                    clearances=tuple(
                        replace(
                            clear,
                            constant=clear.constant - guard.nearest[disjunction.time, face.index],
                        )
                        for clear in face.clearances
                    ),
                )
                for face in disjunction.faces
            ),
        )
        for disjunction in program.disjunctions
    ]
    return program


def _nowhere(guard: Guard) -> Plan:
    """Return a plan of the other agent that counts for nothing: at the origin until it arrives."""
    game = guard.game
    agent = game.agents[1 - guard.agent]
    controls = np.zeros((game.horizon, agent.control_dim))
    means = np.zeros((game.horizon + 1, agent.state_dim))
    return Plan(controls, means, len(guard.nearest))
