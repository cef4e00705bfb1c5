"""Rare crashes of plans against closed forms, against 10^8 plain episodes, and their intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, norm

from ppg_env import Game, InputError, evaluate, make_game
from ppg_env.risk.batches import BLOCK
from ppg_env.risk.importance_sampling import crash_weights, rare_risk
from ppg_env.risk.monte_carlo import crash_counts
from tests.marks import first
from tests.oracles.closed_forms import boxes, wall
from tests.oracles.plain_monte_carlo import CASES, case, counted, fly
from tests.ppg_env.strategies import Play, plays

FAR = 4.5
"""Standard errors that fixed seeds must stay within: chance exceeds them once in 150,000."""


@pytest.mark.parametrize("angle", [0.0, 0.7])
@pytest.mark.parametrize("sigmas", [1.0, 3.0, 7.0, 12.0, 30.0])
def test_an_agent_before_a_wall_has_the_probability_of_a_half_plane(
    sigmas: float, angle: float
) -> None:
    game, profile = wall(sigmas * np.sqrt(2.0), angle)
    found = rare_risk(game, profile, 2000)
    assert found.any.value == pytest.approx(norm.sf(sigmas), rel=1e-3 if sigmas > 1 else 0.02)
    assert found.any.trusted
    assert found.agents == found.encounters == [found.any]


@pytest.mark.parametrize(
    ("distance", "across"),
    [(3.0, 0.0), (6.0, 0.5), (8.0, 6.0), (13.0, 0.0), (13.0, 1.5), (2.0, 10.0), (9.0, 8.0)],
)
def test_two_boxes_at_a_single_instant_have_a_closed_form(distance: float, across: float) -> None:
    game, profile, exact = boxes(distance, across)
    assert 1e-15 < exact < 0.4
    found = rare_risk(game, profile, 50_000).any
    assert found.trusted
    assert abs(found.value - exact) <= FAR * found.standard_error + 1e-5 * exact
    assert found.standard_error <= 0.02 * exact


@pytest.mark.parametrize("way", ["instants", "swept"])
@pytest.mark.parametrize("name", first(4, CASES))
def test_a_hundred_million_plain_episodes_agree(name: str, way: str) -> None:
    record = counted()
    samples, counts = record["samples"], record["counts"][name][way]
    found = rare_risk(*case(name), 20_000, seed=1, swept=way == "swept")
    listed = [*found.agents, *found.encounters, found.any]
    hits = [*counts["agents"], *counts["encounters"], counts["any"]]
    for rare, plain in zip(listed, hits, strict=True):
        if rare.trusted:
            error = np.hypot(rare.standard_error, np.sqrt(max(rare.value, 1e-12) / samples))
            assert abs(rare.value - plain / samples) <= FAR * error + 2 / samples
        else:
            assert binomtest(plain, samples, min(rare.high, 1.0)).pvalue > 1e-5 or (
                plain / samples <= rare.high
            )
    assert found.any.trusted
    assert counts["any"] > 500
    assert found.any.standard_error < 0.05 * found.any.value


@pytest.mark.slow
def test_intervals_cover_the_truth_as_often_as_they_say() -> None:
    game, profile, exact = boxes(8.0, 6.0)
    runs = [rare_risk(game, profile, 2 * BLOCK, seed).any for seed in range(1000)]
    assert all(run.trusted for run in runs)
    covered = sum(run.low <= exact <= run.high for run in runs)
    assert 930 <= covered <= 970
    spread = np.std([run.value for run in runs])
    assert np.mean([run.standard_error for run in runs]) == pytest.approx(spread, rel=0.08)


@given(plays(scale="exact"), st.booleans(), st.integers(0, 100))
def test_random_plays_agree_with_counting(play: Play, swept: bool, seed: int) -> None:
    found = rare_risk(play.game, play.profile, 4000, seed, swept=swept)
    each, any_agent = crash_counts(play.game, play.profile, 4000, seed, swept=swept).estimates(
        1 - 1e-7
    )
    for rare, plain in zip([*found.agents, found.any], [*each, any_agent], strict=True):
        slack = 6 * rare.standard_error if rare.trusted else rare.high
        assert plain.low <= rare.value + slack
        assert rare.value - slack <= plain.high


@given(plays(scale="exact"))
def test_estimates_are_never_above_the_union_bound(play: Play) -> None:
    """But for the shares of agents in the mixture, by which weights may exceed it."""
    game = replace(play.game, margin_cap=26.0)
    judged, found = evaluate(game, play.profile), rare_risk(game, play.profile, 500)
    one_mixture = len(game.agents) == 1 or (len(game.agents) == 2 and not game.obstacles)
    most = 1 if one_mixture else len(game.agents)
    assert found.any.value <= most * judged.risk_bound_any * (1 + 1e-5) + 1e-9


def test_a_small_risk_next_to_a_large_one_is_estimated_too() -> None:
    # Two pairs, far from each other: 1e-3 for one and 1e-9 for the other.
    game = make_game("parallel", noise=1.846)
    places = [([10.0, y], [95.0, y]) for y in (70.0, 47.0, 500.0, 464.5)]
    agents = tuple(replace(game.agents[0], start=s, goal=g) for s, g in places)
    game = Game(agents)
    found = rare_risk(game, fly(game), 40_000)
    assert found.agents[0].value == pytest.approx(1e-3, rel=0.02)
    assert found.agents[2].value < 1e-6
    for estimate in found.agents:
        assert estimate.trusted
        assert estimate.standard_error < 0.03 * estimate.value
    assert found.any.value == pytest.approx(found.agents[0].value, rel=0.03)


def test_results_do_not_depend_on_the_number_of_workers() -> None:
    game, profile = case("crowd 1e-4")
    one, two, four = (
        rare_risk(game, profile, 5 * BLOCK + 100, seed=3, workers=workers) for workers in (1, 2, 4)
    )
    assert one == two == four
    assert rare_risk(game, profile, 5 * BLOCK + 100, seed=4).any != one.any


def test_progress_adds_up_to_the_samples() -> None:
    seen: list[int] = []
    game, profile = case("side 1e-3")
    rare_risk(game, profile, 2 * BLOCK + 7, progress=seen.append)
    assert seen == [BLOCK, BLOCK, 7]


@pytest.mark.parametrize(("samples", "seed"), [(0, 0), (10, -1)])
def test_no_samples_and_negative_seeds_are_refused(samples: int, seed: int) -> None:
    with pytest.raises(InputError):
        rare_risk(*case("side 1e-3"), samples, seed)


def test_a_probability_too_small_for_a_number_is_not_called_zero() -> None:
    game = make_game("parallel", noise=1e-4)
    found = rare_risk(game, fly(game), 1000)
    assert found.any.value == 0
    assert 0 < found.any.high < 1e-300
    assert found.any.trusted


def test_without_encounters_no_agent_crashes() -> None:
    game = Game((make_game("head_on").agents[0],))
    found = rare_risk(game, fly(game), 100)
    assert found.any.value == found.agents[0].value == 0
    assert found.encounters == []


def test_means_that_overlap_are_no_obstacle() -> None:
    game = make_game("head_on", noise=0.01)
    found = rare_risk(game, fly(game), 1000)
    assert found.any.value == pytest.approx(1.0, rel=1e-6)


def test_too_few_samples_are_not_trusted_and_the_limit_still_holds() -> None:
    game, profile = case("crowd 1e-4")
    few, many = rare_risk(game, profile, 20), rare_risk(game, profile, 100_000)
    assert not few.any.trusted
    assert "more episodes" in few.any.advice
    assert few.any.high > many.any.value


def test_more_confidence_gives_wider_intervals_from_the_same_simulation() -> None:
    flown = case("crowd 1e-3")
    weights = crash_weights(*flown, 5000)
    usual, sure = (weights.risk(level).any for level in (0.95, 0.999))
    assert sure.low < usual.low < usual.value == sure.value < usual.high < sure.high
    assert weights.risk(0.999) == rare_risk(*flown, 5000, confidence=0.999)
