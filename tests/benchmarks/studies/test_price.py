"""Prices: ratios from rows, limits from counts, words from data."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from benchmarks.comparison.compare import FEW
from benchmarks.studies import prices
from benchmarks.studies.price import data, study
from benchmarks.studies.results import NEGLIGIBLE
from ppg_env.formats.game_file import game_from_tables
from ppg_env.game.evaluation import evaluate
from ppg_env.game.plan import make_profile
from ppg_env.risk.monte_carlo import crash_counts
from tests.benchmarks.studies.conftest import SMALL, crashing

limits = st.floats(0.0, 1.0).flatmap(
    lambda high: st.floats(0.0, high).flatmap(
        lambda low: st.tuples(st.just(low), st.floats(low, high), st.just(high))
    )
)


def one(selfish, social, cost=1.0):
    named = dict.fromkeys(data.AXES, 0)
    return prices.Price(
        crashing(*selfish, social_cost=cost, **named), crashing(*social, social_cost=1.0, **named)
    )


@pytest.mark.slow
def test_ratios_are_those_of_games_and_plans_evaluated_again(whole):
    """The evaluator and a simulation of our own, from the plans in the store."""
    rows = whole(study.STUDY)
    found = prices.prices([prices.digest(row, data.AXES) for row in rows], "nash", data.AXES)
    assert len(found) == len(data.OBJECTIVES) * len(data.GAINS)
    counted = 0
    for known in found:
        judged, hits = {}, {}
        for row in rows:
            if all(getattr(row, name) == known.selfish[name] for name in data.AXES):
                game = game_from_tables(row.game, "row")
                profile = make_profile(game, row.controls)
                judged[row.player] = evaluate(game, profile)
                hits[row.player] = crash_counts(game, profile, SMALL.episodes, SMALL.seed).any
        nash, social = judged["nash"], judged["social"]
        assert known.cost == pytest.approx(nash.shifted_cost.sum() / social.shifted_cost.sum())
        assert known.bound == pytest.approx(nash.risk_bound_any / social.risk_bound_any)
        both = hits["nash"], hits["social"]
        if min(both) >= FEW:  # rarer ones are not counted but sampled
            above, below = (binomtest(k, SMALL.episodes).proportion_ci(0.95) for k in both)
            assert known.risk == pytest.approx(both[0] / both[1])
            assert known.riskier == (above.low > below.high)
            assert known.least == pytest.approx(above.low / below.high)
            counted += 1
    assert counted


def test_the_equilibrium_of_the_potential_costs_no_less_than_the_optimum(whole):
    rows = [prices.digest(row, data.AXES) for row in whole(study.STUDY)]
    for name in prices.EQUILIBRIA:
        found = prices.prices(rows, name, data.AXES)
        assert found
        assert all(known.cost >= 1 - 1e-9 for known in found)


@given(limits, limits)
def test_risks_differ_significantly_when_limits_that_matter_are_disjoint(selfish, social):
    known = one(selfish, social)
    assert known.riskier == (selfish[0] > max(social[2], NEGLIGIBLE))
    assert known.safer == (social[0] > max(selfish[2], NEGLIGIBLE))
    assert not (known.riskier and known.safer)
    assert known.least <= known.most


def test_negligible_risks_are_as_good_as_one_another():
    tiny, tinier = (1e-15, 2e-15, 3e-15), (0.0, 1e-30, 1e-29)
    known = one(tiny, tinier)
    assert (known.least, known.risk, known.most) == (1, 1, 1)
    assert not known.riskier
    assert one((0.1, 0.2, 0.3), tinier).risk == pytest.approx(0.2 / NEGLIGIBLE)
    assert one((0.1, 0.2, 0.3), (0.05, 0.1, 0.15)).risk == pytest.approx(2)


def test_games_without_an_optimum_have_no_price():
    game = dict.fromkeys(data.AXES, 0)
    selfish = crashing(0, 0, 1, player="nash", social_cost=1.0, **game)
    failed = {"player": "social", "scenario": "head_on", "reason": "the horizon is too short"}
    assert prices.prices([selfish, failed], "nash", data.AXES) == []
    (said,) = prices.missing([selfish, failed])
    assert "1 plans are missing" in said
    assert "too short" in said


def test_words_count_what_the_prices_say():
    low, high, wide = (0.01, 0.02, 0.03), (0.1, 0.2, 0.3), (0.0, 0.05, 0.5)
    some = [one(high, low), one(high, low, cost=1.2), one(low, high), one(wide, low)]
    said = prices.verdict(some, "nash")
    assert "cost ratio 1.000 to 1.200, within 5% of one in 3 of 4 games" in said
    assert (
        "significantly riskier than the optimum in 2, safer in 1, no significant difference in 1"
        in said
    )
    assert said.endswith("as the paper claims, in 1.")
    assert prices.riskiest(some) is some[0]
    assert prices.summary({"nash": some}) == (
        "1.000 to 1.200", "2 / 1", "10", "-", "-", "-"
    )  # fmt: skip


def test_the_study_has_a_line_for_every_family_and_every_difference(whole):
    rows = [prices.digest(row, data.AXES) for row in whole(study.STUDY)]
    families, different = study.tables(rows)
    assert len(families.lines) == len(data.OBJECTIVES) * len(data.GAINS)
    significant = [
        known
        for name in prices.EQUILIBRIA
        for known in prices.prices(rows, name, data.AXES)
        if known.riskier or known.safer
    ]
    assert len(different.lines) == len(significant) > 0
    assert np.all([len(line) == len(different.columns) for line in different.lines])
