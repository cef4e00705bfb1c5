"""Solve a program by the engine or by the reference formulation.

``ENGINE`` is the project's own search, exact and fast; any other name is a MILP solver that takes
the paper's formulation through cvxpy, the reference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from ppg_env.game.objective import Objective
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.engine.arrival_search import engine_search
from solvers.engine.tie_break import break_ties
from solvers.search_result import SearchResult

if TYPE_CHECKING:
    from solvers.reference.formulation import Program

ENGINE = "ENGINE"


def minimise(
    objective: Objective,
    movers: Sequence[int],
    given: Profile | None,
    solver: str,
    budget: Budget,
    on_progress: Callable[[str, float], None] = lambda what, value: None,
    advise: Callable[[], Profile | None] = lambda: None,
) -> SearchResult:
    """Return the cheapest plans of ``movers`` and a proved bound; other agents keep ``given``.

    The engine calls ``on_progress`` with every better ``value`` and ``bound``, and ``advise`` for
    plans of all agents once the search has become long.
    """
    if solver == ENGINE:
        return engine_search(objective, movers, given, budget, on_progress, advise)
    from solvers.reference.solve import search

    return search(_compiled(objective, tuple(movers)), given, solver, budget)


def tidied(objective: Objective, movers: Sequence[int], result: SearchResult) -> SearchResult:
    """Return the shortest and smoothest plans of ``movers`` that cost as much as those of a result.

    See :mod:`solvers.engine.tie_break`.
    """
    best = result.priced
    if best is None:
        return result
    others = {i: plan for i, plan in enumerate(best.profile) if i not in movers}
    return SearchResult.of(
        result.status,
        result.bound,
        break_ties(objective, tuple(movers), others, best),
        result.detail,
    )


@lru_cache(maxsize=128)
def _compiled(objective: Objective, movers: tuple[int, ...]) -> Program:
    """Return the compiled program; only its parameters change from one profile to the next."""
    from solvers.reference.formulation import Program

    return Program(objective, movers)


def check_solver(name: str) -> str:
    """Return the name of a solver in the spelling that :func:`minimise` takes.

    Raises
    ------
    InputError
        If it is neither the engine nor a MILP solver that cvxpy finds installed.
    """
    if name.upper() == ENGINE:
        return ENGINE
    from solvers.reference.cvxpy_backend import check_backend

    return check_backend(name)
