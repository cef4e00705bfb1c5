"""How scores order plans against crashes: tau, and pairs that differ significantly."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.studies.orders import GamePlans, PlanPair, clearest, games
from benchmarks.studies.surrogate import study
from benchmarks.studies.surrogate.data import SCORES
from tests.benchmarks.studies.conftest import crashing


def plan(score, low, value=None, high=None, **others):
    value = low if value is None else value
    scores = [score] * len(SCORES)
    game = {"scenario": "head_on", "speed": "l1", "gain": 0.5}
    made = {"plan": f"{score} {low}", "player": "straight", "scores": scores, "margins": [1.0]}
    return crashing(low, value, low if high is None else high, **(game | made | others))


rated = st.lists(
    st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=2, max_size=8, unique=True
)


@given(rated)
def test_tau_is_that_of_pairs_counted_one_by_one(pairs):
    """tau-b = (C - D) / sqrt((P - ties in one) (P - ties in the other))."""
    plans = [plan(score, chance / 10) for score, chance in pairs]
    signs = [(np.sign(a[0] - b[0]), np.sign(a[1] - b[1])) for a, b in combinations(pairs, 2)]
    products = sum(x * y for x, y in signs)
    spread = np.sqrt(float(sum(abs(x) for x, _ in signs) * sum(abs(y) for _, y in signs)))
    found = GamePlans("any", plans, []).tau(0)
    if spread:
        assert found == pytest.approx(products / spread)
        turned = [plan(-score, chance / 10) for score, chance in pairs]
        assert GamePlans("any", turned, []).tau(0) == pytest.approx(-found)
    else:
        assert np.isnan(found)


@given(rated)
def test_every_distinguished_pair_is_right_tied_or_wrong(pairs):
    rows = [plan(score + 1.0, chance / 10) for score, chance in pairs]
    (game,) = games(rows)
    apart = [(a, b) for a, b in combinations(pairs, 2) if a[1] != b[1]]
    assert len(game.pairs) == len(apart)
    counts = game.counts(0)
    assert sum(counts.values()) == len(apart)
    assert counts["wrong"] == sum((a[0] - b[0]) * (a[1] - b[1]) < 0 for a, b in apart)
    assert counts["tied"] == sum(a[0] == b[0] for a, b in apart)


def test_limits_that_overlap_tell_nothing_apart():
    (game,) = games([plan(1.0, 0.1, 0.2, 0.3), plan(2.0, 0.25, 0.4, 0.5)])
    assert game.pairs == []
    (game,) = games([plan(1.0, 0.1, 0.2, 0.3), plan(2.0, 0.31, 0.4, 0.5)])
    assert len(game.pairs) == 1


def test_plans_that_are_the_same_count_once_and_no_plan_not_at_all():
    rows = [plan(1.0, 0.1, plan="x"), plan(1.0, 0.1, plan="x"), plan(2.0, 0.3, plan="y")]
    others = [{"player": "nash", "reason": "no plan"}, plan(9.0, 0.9, margins=[2.0, -0.1])]
    (game,) = games([*rows, *others])
    assert [one["plan"] for one in game.plans] == ["x", "y"]


def test_the_clearest_example_is_the_wrong_pair_furthest_apart():
    rows = [plan(3.0, 0.001), plan(1.0, 0.1), plan(2.0, 0.01), plan(4.0, 0.5)]
    found = games(rows)
    _game, pair = clearest(found, 0)
    assert (pair.safer["scores"][0], pair.riskier["scores"][0]) == (3.0, 1.0)
    assert pair.least == pytest.approx(100)
    said = " ".join(study.words(rows))
    assert "of these pairs 3 right, 0 tied, 3 wrong (50.0%)" in said
    assert "at least 100 times less likely to crash" in said
    in_order = games([plan(1.0, 0.1), plan(2.0, 0.2)])
    assert clearest(in_order, 0) is None


def test_scores_within_the_tolerance_are_tied():
    close = PlanPair(plan(1.0, 0.1), plan(0.995, 0.2))
    assert close.order(0) == "tied"
    assert PlanPair(plan(1.0, 0.1), plan(1.02, 0.2)).order(0) == "right"
    assert PlanPair(plan(1.0, 0.1), plan(0.98, 0.2)).order(0) == "wrong"
    assert PlanPair(plan(0.0, 0.1), plan(0.0, 0.2)).order(0) == "tied"
