"""Every estimator agrees with counts of very many plain episodes of five plans of the library.

The counts are those of tests/oracles/billion_episodes.json, at their stated numbers of episodes.
"""

from __future__ import annotations

import pytest

from ppg_env.env.players import track
from ppg_env.env.rules import Rules
from ppg_env.risk import crash_counts, lower_bounds, rare_risk, risk_bounds, split_risk
from ppg_env.risk.likeliest_crash import likeliest_crash
from ppg_env.support.statistics import proportion
from tests.marks import first
from tests.oracles.billion_episodes import CASES, PIECE, SAMPLES, SEED, case, stored

SURE = 1 - 1e-5
"""Confidence of the counts' intervals; the seeds are fixed."""

FAR = 4.5


def limits(name: str) -> list[tuple[float, float]]:
    """Limits of the crash probability of each agent, and of any, from the counts."""
    row = stored()["cases"][name]
    counts = [proportion(hits, row["samples"], SURE) for hits in [*row["agents"], row["any"]]]
    return [(count.low, count.high) for count in counts]


@pytest.mark.parametrize("name", CASES)
def test_proved_limits_contain_the_count(name: str) -> None:
    game, profile = case(name)
    bounds = risk_bounds(game, profile)
    lows = lower_bounds(game, profile, bounds)
    each = zip([*lows[0], lows[1]], [*bounds.agents, bounds.any], limits(name), strict=True)
    for lower, event, (low, high) in each:
        assert event.least <= lower * (1 + 1e-9)
        assert lower <= high
        assert low <= event.tree
    crash = likeliest_crash(game, profile)
    assert crash is not None
    assert crash.log_form < 0


@pytest.mark.parametrize("name", first(3, CASES))
def test_importance_sampling_agrees_with_the_count(name: str) -> None:
    game, profile = case(name)
    risk = rare_risk(game, profile, 20_000, seed=1)
    for estimate, (low, high) in zip([*risk.agents, risk.any], limits(name), strict=True):
        assert low - FAR * estimate.standard_error <= estimate.value
        assert estimate.value <= high + FAR * estimate.standard_error
    assert risk.any.trusted


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_splitting_agrees_with_the_count(name: str) -> None:
    game, profile = case(name)
    schedule = tuple(10_000 if plan.arrival is None else plan.arrival for plan in profile)
    rules = Rules(
        arrival="schedule",
        schedule=schedule,
        saturation="none",
        on_crash="continue",
        on_goal=game.on_goal,
    )
    risk = split_risk(game, track(game, profile), 1000, seed=1, rules=rules)
    low, high = limits(name)[-1]
    slack = FAR * risk.any.standard_error
    assert low - slack <= risk.any.value <= high + slack
    assert slack < risk.any.value or not risk.any.trusted


def test_another_seed_counts_the_same_and_the_first_piece_is_in_the_file() -> None:
    name = CASES[1]
    game, profile = case(name)
    estimate = crash_counts(game, profile, 200_000, seed=SEED + 1).estimates(SURE)[1]
    low, high = limits(name)[-1]
    assert estimate.low <= high
    assert low <= estimate.high
    for row in stored()["cases"].values():
        assert row["samples"] == SAMPLES or row["samples"] % PIECE == 0
        assert row["any"] > 50
        assert max(row["agents"]) <= row["any"] <= sum(row["encounters"])
