r"""Solve one compiled program: bound from the back end, plans from the evaluator.

Each round solves the mixed-integer program, whose tangents make it a relaxation, so its dual
bound holds for the true objective.  Its discrete decisions are then fixed and the rest solved
again as a linear program: that removes what integrality tolerance times big-M lets through, and
refines the tangents where the answer sits.  The evaluator prices the plans; rounds end when
price and bound agree.
"""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.evaluation import evaluate
from ppg_env.game.objective import loss
from ppg_env.game.plan import Plan, Profile, make_plan
from solvers.budget import Budget
from solvers.reference import cvxpy_backend as backend
from solvers.reference.formulation import Program
from solvers.search_result import SearchResult
from solvers.solution import Status

ROUNDS = 12
"""Most mixed-integer solves of one search; two or three are usual."""

POLISHES = 8
"""Most linear programs between two of them."""


def search(program: Program, given: Profile | None, solver: str, budget: Budget) -> SearchResult:
    """Minimise ``program`` with the other agents' plans ``given`` (None when all agents move)."""
    if any(mover.earliest is None for mover in program.movers.values()):
        return SearchResult(Status.UNREACHABLE, float("inf"))
    program.update(given)
    floor = sum(
        program.objective.time[i] * (mover.earliest or 0) for i, mover in program.movers.items()
    )
    best = SearchResult(Status.NO_INCUMBENT, float(floor))
    for _ in range(ROUNDS):
        if budget.out:
            break
        program.release()
        answer = backend.solve(program.problem, solver, budget.left)
        if answer.outcome == "infeasible" and best.profile is None:
            return SearchResult(Status.INFEASIBLE, float("inf"))
        bound = max(best.bound, answer.bound) if np.isfinite(answer.bound) else best.bound
        point = _polished(program, given, solver, budget) if answer.has_point else None
        if point is None or point.value >= best.value:
            point = best
        best = SearchResult(
            Status.FEASIBLE, bound, point.profile, point.evaluation, point.value, answer.detail
        )
        if best.profile is None:
            lost = answer.has_point or answer.outcome == "error"
            status = Status.ERROR if lost else Status.NO_INCUMBENT
            return SearchResult(status, bound, detail=answer.detail)
        agreed = best.value - bound <= tol.REFINEMENT * max(1.0, abs(best.value))
        if agreed and answer.outcome == "optimal":
            return _with_status(best, Status.OPTIMAL)
        if answer.outcome != "optimal":
            break
    return best


def _with_status(found: SearchResult, status: Status) -> SearchResult:
    return SearchResult(
        status, found.bound, found.profile, found.evaluation, found.value, found.detail
    )


def _polished(
    program: Program, given: Profile | None, solver: str, budget: Budget
) -> SearchResult | None:
    """The best accepted plan with the incumbent's discrete decisions; None if there is none."""
    best = _judged(program, given)
    program.fix(program.decisions())
    for _ in range(POLISHES):
        left = None if budget.left is None else max(budget.left, 1.0)  # a linear program: grant it
        if not backend.solve(program.problem, solver, left).has_point:
            break
        found = _judged(program, given)
        gap = _refine(program)
        if found is not None and (best is None or found.value < best.value):
            best = found
        if gap <= tol.REFINEMENT / 10:
            break
    return best


def _judged(program: Program, given: Profile | None) -> SearchResult | None:
    """The program's current controls as plans, if the evaluator accepts them."""
    plans: list[Plan] = []
    for i, agent in enumerate(program.game.agents):
        if i in program.movers:
            plans.append(make_plan(agent, program.movers[i].controls.value))
        else:
            assert given is not None
            plans.append(given[i])
    # The given plans may be predictions; the movers' were made from their controls just now.
    evaluation = evaluate(program.game, tuple(plans), as_given=True)
    if evaluation.violations(program.movers):
        return None
    value = evaluation.weighted(program.objective)
    return SearchResult(Status.FEASIBLE, float("-inf"), tuple(plans), evaluation, value)


def _refine(program: Program) -> float:
    """Add tangents at the current margins; the weighted error that the old ones made."""
    error = 0.0
    for weight, part in zip(program.encounter_weights, program.separations, strict=True):
        margins = np.clip(part.margin.value, 0.0, program.game.margin_cap)
        gone = loss(program.game, margins) - part.tangents.model_loss(margins)
        error += weight * float(gone.sum())
        if gone.max() > 0 and program.game.objective == "risk":
            part.tangents.add(margins)
    return error
