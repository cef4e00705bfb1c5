"""Solve a mixed-integer program through cvxpy, and check what the back end proved.

Back ends are unreliable: at a time limit HiGHS reports x = 0 with value 0 although it has no
incumbent.  An :class:`Answer` states whether there is an incumbent and has a lower bound only
where the back end proves one; plans are evaluated in any case.

Problems must be minimisations without a constant term: the dual bound of HiGHS omits constants.
"""

from __future__ import annotations

import contextlib
import sys
import warnings
from dataclasses import dataclass
from time import monotonic
from typing import Any

import cvxpy as cp
import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError

HIGHS_HAS_POINT = 2
"""``kSolutionStatusFeasible`` of HiGHS."""


@dataclass(frozen=True)
class Answer:
    """The outcome of one solve.

    Attributes
    ----------
    outcome : ``optimal``, ``incumbent`` (stopped early with a point), ``none`` (stopped early
        without one), ``infeasible`` or ``error``.
    bound : proved lower bound on the optimum; -inf where there is none.
    detail : the status that the back end reported, for messages.
    """

    outcome: str
    bound: float
    detail: str

    @property
    def has_point(self) -> bool:
        """Whether the problem's variables hold an incumbent."""
        return self.outcome in ("optimal", "incumbent")


def check_backend(name: str) -> str:
    """Return the cvxpy name of a solver that can solve the programs.

    Raises
    ------
    InputError
        If it is unknown to cvxpy, not installed, or cannot take integer variables.
    """
    from cvxpy.reductions.solvers.defines import INSTALLED_MI_SOLVERS

    usable = [str(solver) for solver in INSTALLED_MI_SOLVERS]
    if name.upper() not in usable:
        raise InputError(
            "solver",
            f"{name!r} is not an installed MILP solver",
            "use one of " + ", ".join(["ENGINE", *usable]),
        )
    return name.upper()


def solve(problem: cp.Problem, solver: str, time_limit: float | None) -> Answer:
    """Solve ``problem`` with a solver that :func:`check_backend` returned.

    ``time_limit`` is in seconds; None is no limit.
    """
    started = monotonic()
    try:
        # cvxpy warns of limits, which the answer reports; Gurobi prints its licence to stdout.
        with warnings.catch_warnings(), contextlib.redirect_stdout(sys.stderr):
            warnings.simplefilter("ignore")
            problem.solve(solver=solver, warm_start=False, **_options(solver, time_limit))
    except Exception as failure:  # back ends raise errors of every kind
        # SCIP through cvxpy raises when the time limit comes before the first incumbent.
        late = time_limit is not None and monotonic() - started >= 0.9 * time_limit
        detail = f"{type(failure).__name__}: {failure}"
        return Answer("none" if late else "error", float("-inf"), detail)
    return _answer(problem, solver)


def _answer(problem: cp.Problem, solver: str) -> Answer:
    """Return what a solve of ``problem`` says; a point counts only if its values are finite."""
    stats, status = problem.solver_stats, str(problem.status)
    extra = None if stats is None else stats.extra_stats
    if status in (cp.INFEASIBLE, cp.settings.INFEASIBLE_OR_UNBOUNDED):
        return Answer("infeasible", float("inf"), status)
    bound = _proved_bound(solver, extra)
    if status == cp.settings.USER_LIMIT and not _has_incumbent(solver, extra, problem):
        return Answer("none", bound, status)
    if status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE, cp.settings.USER_LIMIT):
        return Answer("error", float("-inf"), status)
    if not _is_finite(problem):
        return Answer("error", float("-inf"), f"{status}, with values that are not finite")
    if status == cp.OPTIMAL:
        return Answer("optimal", min(bound, float(problem.value)), status)
    return Answer("incumbent", bound, status)


def _is_finite(problem: cp.Problem) -> bool:
    """Return whether the value and all variables are finite numbers."""
    values = [problem.value, *(variable.value for variable in problem.variables())]
    return all(value is not None and bool(np.isfinite(value).all()) for value in values)


def _options(solver: str, time_limit: float | None) -> dict[str, Any]:
    if solver == cp.HIGHS:
        options: dict[str, Any] = {
            "mip_rel_gap": tol.MIP_GAP,
            "mip_abs_gap": tol.MIP_GAP,
            "mip_feasibility_tolerance": tol.FEASIBILITY,
            "primal_feasibility_tolerance": tol.FEASIBILITY,
            "dual_feasibility_tolerance": tol.FEASIBILITY,
        }
        return options if time_limit is None else options | {"time_limit": max(time_limit, 1e-3)}
    if solver == cp.SCIP:
        parameters = {"limits/gap": 0.0, "numerics/feastol": tol.FEASIBILITY}
        limit = {} if time_limit is None else {"limits/time": max(time_limit, 1e-3)}
        return {"scip_params": parameters | limit}
    if solver == cp.GUROBI:
        options = {
            "MIPGap": 0.0,
            "MIPGapAbs": tol.MIP_GAP,
            "FeasibilityTol": tol.FEASIBILITY,
            "IntFeasTol": tol.FEASIBILITY,
            "Threads": 1,
        }
        return options if time_limit is None else options | {"TimeLimit": max(time_limit, 1e-3)}
    return {}


def _proved_bound(solver: str, extra: Any) -> float:
    """Return the dual bound; -inf where there is none.

    Solvers without options above have none, since their gaps are loose.
    """
    try:
        if solver == cp.HIGHS:
            bound = float(extra.mip_dual_bound)
        elif solver == cp.GUROBI:
            bound = float(extra.ObjBound)
        elif solver == cp.SCIP:
            bound = float(extra["model"].getDualbound())
        else:
            return float("-inf")
    except (AttributeError, KeyError, TypeError, ValueError):
        return float("-inf")
    return float("-inf") if np.isnan(bound) else bound


def _has_incumbent(solver: str, extra: Any, problem: cp.Problem) -> bool:
    if solver == cp.HIGHS:
        return int(getattr(extra, "primal_solution_status", 0)) == HIGHS_HAS_POINT
    return problem.value is not None and all(v.value is not None for v in problem.variables())
