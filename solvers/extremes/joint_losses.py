"""The least losses of two agents whose plans are in given sets: a search by the engine."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Plan, make_plan
from solvers.budget import Budget
from solvers.engine.branch_and_bound import BranchAndBound
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.presolve import Subproblem, presolve_encounters
from solvers.extremes.plan_set import PlanSet

MOST_NODES = 1000
"""Linear programs for one pair of sets; the bound that is proved by then counts."""


class LeastLosses(NamedTuple):
    """A lower bound on the losses of the pair, and plans that lose about as much, if some do."""

    bound: float
    plans: tuple[Plan, Plan] | None


def least_losses(
    game: Game, sets: tuple[PlanSet, PlanSet], most: float, budget: Budget
) -> LeastLosses:
    """Return the least losses of plans in ``sets``, at most ``most``.

    The bound is infinite if the reachable sets exclude that the bodies keep apart.
    """
    nothing = np.zeros(2)
    losses = Objective(game, nothing, np.ones(1), nothing)
    subproblem = Subproblem(losses, (0, 1), {})
    arrivals = {i: plans.arrival for i, plans in enumerate(sets)}
    presolved = presolve_encounters(subproblem, (0,), arrivals)
    if presolved is None:
        return LeastLosses(np.inf, None)

    def make() -> FixedProgram:
        program = FixedProgram(subproblem, arrivals, presolved)
        for i, plans in enumerate(sets):
            columns = program.controls[i].ravel()
            for row, limit in zip(*plans.rows, strict=True):
                program.limit(columns, row, limit)
        return program

    best: list[tuple[float, dict[int, np.ndarray]]] = []

    def note(program: FixedProgram, point: np.ndarray, estimate: float, spare: float) -> float:
        if not best or estimate < best[-1][0]:
            best.append((estimate, program.controls_at(point)))
        return estimate

    child = budget.child(MOST_NODES)
    tree = BranchAndBound(make, 0.0, most, child, note)
    tree.search(most)
    budget.charge(child)
    plans = None
    if best:
        first, second = (make_plan(game.agents[i], best[-1][1][i]) for i in (0, 1))
        plans = first, second
    return LeastLosses(-np.inf if tree.failed else tree.bound, plans)
