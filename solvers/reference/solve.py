r"""Solve a compiled program: bounds from the back end, plans from the evaluator.

Each round solves the mixed-integer program, whose tangents make it a relaxation, so its dual
bound holds for the true objective.  Its discrete decisions are then fixed and the rest is solved
again as a linear program: that removes what integrality tolerance times big-M lets through, and
refines the tangents at the margins of the solution.  The evaluator prices the plans; rounds end
when price and bound agree.
"""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.objective import loss
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.pricing import PricedProfile, price
from solvers.reference import cvxpy_backend as backend
from solvers.reference.formulation import Program
from solvers.search_result import SearchResult
from solvers.solution import Status

ROUNDS = 12
"""Largest number of mixed-integer programs in one search; two or three are usual."""

REFINEMENTS = 8
"""Largest number of linear programs between two of them."""


def search(program: Program, given: Profile | None, solver: str, budget: Budget) -> SearchResult:
    """Minimise ``program`` with the other agents' plans ``given`` (None when all agents move)."""
    if any(mover.earliest is None for mover in program.movers.values()):
        return SearchResult(Status.UNREACHABLE, float("inf"))
    program.update(given)
    times = program.objective.time
    bound = float(sum(times[i] * (mover.earliest or 0) for i, mover in program.movers.items()))
    best: PricedProfile | None = None
    detail = ""
    for _ in range(ROUNDS):
        if budget.out:
            break
        program.release()
        answer = backend.solve(program.problem, solver, budget.left)
        if answer.outcome == "infeasible" and best is None:
            return SearchResult(Status.INFEASIBLE, float("inf"))
        bound = max(bound, answer.bound) if np.isfinite(answer.bound) else bound
        priced = _refined(program, given, solver, budget) if answer.has_point else None
        if priced is not None and (best is None or priced.value < best.value):
            best = priced
        detail = answer.detail
        if best is None:
            failed = answer.has_point or answer.outcome == "error"
            status = Status.ERROR if failed else Status.NO_INCUMBENT
            return SearchResult(status, bound, detail=detail)
        if answer.outcome != "optimal":
            break
        if best.value - bound <= tol.REFINEMENT * max(1.0, abs(best.value)):
            return SearchResult.of(Status.OPTIMAL, bound, best, detail)
    status = Status.NO_INCUMBENT if best is None else Status.FEASIBLE
    return SearchResult.of(status, bound, best, detail)


def _refined(
    program: Program, given: Profile | None, solver: str, budget: Budget
) -> PricedProfile | None:
    """Return the best feasible plans with the discrete decisions of the incumbent, if any."""
    best = _priced(program, given)
    program.fix(program.decisions())
    for _ in range(REFINEMENTS):
        left = None if budget.left is None else max(budget.left, 1.0)  # enough for one LP
        if not backend.solve(program.problem, solver, left).has_point:
            break
        priced = _priced(program, given)
        gap = _add_tangents(program)
        if priced is not None and (best is None or priced.value < best.value):
            best = priced
        if gap <= tol.REFINEMENT / 10:
            break
    return best


def _priced(program: Program, given: Profile | None) -> PricedProfile | None:
    """Return the plans that the program's current controls make, if they are feasible."""
    controls = {i: mover.controls.value for i, mover in program.movers.items()}
    return price(program.objective, controls, dict(enumerate(given or ())))


def _add_tangents(program: Program) -> float:
    """Add tangents at the current margins; return the weighted error of the tangents before."""
    error = 0.0
    for weight, part in zip(program.encounter_weights, program.separations, strict=True):
        margins = np.clip(part.margin.value, 0.0, program.game.margin_cap)
        errors = loss(program.game, margins) - part.tangents.model_loss(margins)
        error += weight * float(errors.sum())
        if errors.max() > 0 and program.game.objective == "risk":
            part.tangents.add(margins)
    return error
