"""One door to the two ways of solving the same programs.

``ENGINE`` is the project's own search, exact and fast; any other name is a MILP solver that takes
the paper's formulation through cvxpy, which stays as the reference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from ppg_env.game.objective import Objective
from ppg_env.game.plan import Profile
from solvers.budget import Budget
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
    tell: Callable[[str, float], None] = lambda what, value: None,
) -> SearchResult:
    """The cheapest plans of ``movers`` while the others keep to ``given``, with a proved bound.

    ``tell`` hears of every better ``value`` and ``bound`` of the engine.
    """
    if solver == ENGINE:
        from solvers.engine.arrival_search import engine_search

        return engine_search(objective, movers, given, budget, tell)
    from solvers.reference.solve import search

    return search(_compiled(objective, tuple(movers)), given, solver, budget)


@lru_cache(maxsize=128)
def _compiled(objective: Objective, movers: tuple[int, ...]) -> Program:
    """Compiled once; only parameters change from one profile to the next."""
    from solvers.reference.formulation import Program

    return Program(objective, movers)


def check_solver(name: str) -> str:
    """The name of a way to solve, in the letters that :func:`minimise` knows.

    Raises
    ------
    InputError
        If it is neither the engine nor a MILP solver that cvxpy finds installed.
    """
    if name.upper() == ENGINE:
        return ENGINE
    from solvers.reference.cvxpy_backend import check_backend

    return check_backend(name)
