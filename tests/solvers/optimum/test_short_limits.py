"""Social optima among walls under short limits, against equilibria under the same limits.

Time is counted in linear programs, so that results do not depend on the machine.
"""

from __future__ import annotations

import pytest

from ppg_env import tolerances as tol
from solvers import best_response_dynamics, social_optimum
from solvers.budget import Budget
from tests.solvers.walled_games import walled_game


@pytest.fixture
def clock(monkeypatch) -> None:
    """Replace the clock by one on which every linear program takes a millisecond."""
    solved = 0

    def tick(budget: Budget) -> None:
        nonlocal solved
        solved += 1
        budget.used += 1

    monkeypatch.setattr(Budget, "tick", tick)
    monkeypatch.setattr("solvers.budget.monotonic", lambda: solved / 1000)


SHORT = [("unequal", 0, 1.0)]
LONG = [
    ("door", 2, 1.0),
    ("door", 0, 6.0),
    ("sweeper", 0, 3.0),
    ("pillars", 2, 3.0),
    ("alcove", 0, 2.0),
]


@pytest.mark.parametrize(
    ("kind", "seed", "limit"),
    SHORT + [pytest.param(*case, marks=pytest.mark.slow) for case in LONG],
)
def test_the_social_search_never_ends_above_the_equilibrium_of_the_same_limit(
    clock, kind, seed, limit
):
    game = walled_game(kind, seed)
    nash = best_response_dynamics(game, time_limit=limit)
    social = social_optimum(game, time_limit=limit)
    assert nash.profile is not None
    assert social.evaluation.social_cost <= nash.evaluation.social_cost + tol.AGREEMENT
    assert social.bound <= social.value + tol.AGREEMENT
