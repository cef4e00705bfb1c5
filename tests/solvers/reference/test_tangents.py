"""Tangents of the loss: below it everywhere, on it where they were asked to touch."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env import make_game
from ppg_env.game.objective import loss
from solvers.reference.tangents import SLOTS, TangentTable

CAPS = st.floats(0.5, 26.0)
COSTS = st.sampled_from([0.0, 1.0, 100.0, 1e4])


def table(goal, cap, cost, steps=4):
    game = make_game("head_on", objective=goal, margin_cap=cap, crash_cost=cost)
    return game, TangentTable(game, steps)


@given(st.sampled_from(["margin", "risk"]), CAPS, COSTS, st.lists(st.floats(0, 1), max_size=20))
def test_tangents_never_rise_above_the_loss(goal, cap, cost, touched):
    game, tangents = table(goal, cap, cost)
    for share in touched if goal == "risk" else []:
        tangents.add(np.full(4, share * cap))
    for margin in np.linspace(0, cap, 301):
        exact = float(loss(game, np.array(margin)))
        assert (tangents.model_loss(np.full(4, margin)) <= exact + 1e-9 * max(1.0, cost)).all()


@given(CAPS, COSTS, st.lists(st.floats(0, 1), min_size=1, max_size=SLOTS))
def test_an_added_tangent_is_exact_where_it_touches(cap, cost, shares):
    game, tangents = table("risk", cap, cost)
    for share in shares:
        tangents.add(share * cap * np.array([1.0, 0.9, 0.5, 0.0]))
    for share in shares:
        margins = share * cap * np.array([1.0, 0.9, 0.5, 0.0])
        # Slopes under 1e-8 are dropped: what that costs is 1e-8 times the cap at most.
        np.testing.assert_allclose(tangents.model_loss(margins), loss(game, margins), atol=3e-7)


@pytest.mark.parametrize("cap", [1.0, 3.0, 10.0])
def test_one_tangent_is_exact_for_the_papers_objective(cap):
    game, tangents = table("margin", cap, 100.0, steps=50)
    margins = np.linspace(0, cap, 50)
    assert tangents.count == 1
    np.testing.assert_allclose(tangents.model_loss(margins), loss(game, margins), atol=1e-12)


@given(st.lists(st.floats(0, 5), min_size=1, max_size=4 * SLOTS))
def test_a_new_tangent_is_exact_however_many_came_before(points):
    game, tangents = table("risk", 5.0, 100.0)
    for point in points:
        tangents.add(np.full(4, point))
        margins = np.full(4, point)
        np.testing.assert_allclose(tangents.model_loss(margins), loss(game, margins), atol=3e-7)


def test_a_reset_forgets_what_was_added():
    _, tangents = table("risk", 5.0, 100.0)
    margins = np.array([0.1, 0.7, 1.3, 2.2])
    before = tangents.model_loss(margins)
    tangents.add(margins)
    assert (tangents.model_loss(margins) > before).any()
    tangents.reset()
    np.testing.assert_array_equal(tangents.model_loss(margins), before)
