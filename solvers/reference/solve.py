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
from solvers.search_result import Claims, SearchResult, conclude
from solvers.solution import Status

ROUNDS = 12
"""Largest number of mixed-integer programs in one search; two or three are usual."""

REFINEMENTS = 8
"""Largest number of linear programs between two of them."""


def search(program: Program, given: Profile | None, solver: str, budget: Budget) -> SearchResult:
    """Minimise ``program`` with the other agents' plans ``given`` (None when all agents move).

    Plans of the movers in ``given`` are no start, but the answers of the back end must agree with
    them.
    """
    if any(mover.earliest is None for mover in program.movers.values()):
        return SearchResult(Status.UNREACHABLE, float("inf"))
    program.update(given)
    times = program.objective.time
    floor = float(sum(times[i] * (mover.earliest or 0) for i, mover in program.movers.items()))
    best, claims = _search(program, given, solver, budget, floor)
    known = _known(program, given)
    if known is not None and claims.complete:
        slack = tol.AGREEMENT * max(1.0, abs(known.value))
        if best is None or known.value < best.value - slack:
            best = known
    return conclude(best, claims, floor)


def _search(
    program: Program, given: Profile | None, solver: str, budget: Budget, bound: float
) -> tuple[PricedProfile | None, Claims]:
    """Return the best plans of some rounds, and what the back end claims; see :func:`search`."""
    best: PricedProfile | None = None
    detail = ""
    for _ in range(ROUNDS):
        if budget.out:
            break
        program.release()
        answer = backend.solve(program.problem, solver, budget.left)
        detail = answer.detail
        if answer.outcome == "infeasible":
            return best, Claims(float("inf"), complete=True)
        bound = max(bound, answer.bound) if np.isfinite(answer.bound) else bound
        priced = _refined(program, given, solver, budget) if answer.has_point else None
        if priced is not None and (best is None or priced.value < best.value):
            best = priced
        if best is None:
            failed, rejected = answer.outcome == "error", answer.has_point
            claims = Claims(bound, complete=False, failed=failed, rejected=rejected, detail=detail)
            return None, claims
        if answer.outcome != "optimal":
            break
        if best.value - bound <= tol.REFINEMENT * max(1.0, abs(best.value)):
            return best, Claims(bound, complete=True, detail=detail)
    return best, Claims(bound, complete=False, detail=detail)


def _known(program: Program, given: Profile | None) -> PricedProfile | None:
    """Return the plans of ``given`` if they are feasible; None if there are none."""
    if given is None:
        return None
    controls = {i: given[i].controls for i in program.movers}
    return price(program.objective, controls, dict(enumerate(given)))


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
