"""Iterated elimination of arrivals: no agent pays more than its response to any plan costs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from ppg_env import tolerances as tol
from solvers.budget import Budget
from solvers.extremes.arrival_vectors import ArrivalVector
from solvers.extremes.response_limit import ResponseLimits


def eliminate(
    vectors: Sequence[ArrivalVector],
    responses: ResponseLimits,
    goal: float,
    rounds: int,
    budget: Budget,
) -> None:
    """Limit the costs of ``vectors`` above ``goal`` by responses, from early arrivals on.

    ``rounds`` limits the programs for one cost.
    """
    numbers = sorted({arrival for vector in vectors for arrival in vector.arrivals})
    for arrival, i in product(numbers, (0, 1)):
        column = [vector for vector in vectors if vector.arrivals[1 - i] == arrival]
        costly = [vector for vector in column if vector.high > goal + tol.AGREEMENT]
        if costly and not budget.out:
            responses.tighten(i, arrival, [vector.arrivals[i] for vector in costly], rounds, budget)
            for vector in column:
                vector.limit()
    for vector in vectors:
        vector.dismiss(goal, budget)
