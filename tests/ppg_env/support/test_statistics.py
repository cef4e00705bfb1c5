from __future__ import annotations

import numpy as np
import pytest
from scipy.special import gammaln, xlogy
from scipy.stats import beta

from ppg_env.support.statistics import (
    Estimate,
    RareEstimate,
    averaged,
    counted,
    difference,
    proportion,
    repeated,
    weighted,
)


@pytest.mark.parametrize(("hits", "samples"), [(0, 10), (1, 10), (5, 10), (10, 10), (7, 1000)])
@pytest.mark.parametrize("confidence", [0.9, 0.95, 0.99])
def test_intervals_are_clopper_pearsons(hits: int, samples: int, confidence: float) -> None:
    tail = (1 - confidence) / 2
    low = beta.ppf(tail, hits, samples - hits + 1) if hits else 0.0
    high = beta.ppf(1 - tail, hits + 1, samples - hits) if hits < samples else 1.0
    found = proportion(hits, samples, confidence)
    assert found.value == hits / samples
    assert (found.low, found.high) == pytest.approx((low, high), abs=1e-12)


def test_known_intervals() -> None:
    # No event in n: 1 - (alpha/2)^(1/n).  The textbook's 2 of 10 is [0.0252, 0.5561].
    assert proportion(0, 1000).high == pytest.approx(1 - 0.025 ** (1 / 1000))
    found = proportion(2, 10)
    assert (found.low, found.high) == pytest.approx((0.0252, 0.5561), abs=5e-5)


@pytest.mark.parametrize("means", [(0, 0), (0.1, 2), (1, 1), (4, 1), (6, 6)])
def test_differences_are_covered_whatever_the_counts(means: tuple[float, float]) -> None:
    """The coverage is summed over all outcomes of a multinomial: nothing is simulated."""
    n = 20
    p, q = (mean / n for mean in means)
    covered = 0.0
    for b in range(n + 1):
        for c in range(n + 1 - b):
            rest = n - b - c
            ways = gammaln(n + 1) - gammaln(b + 1) - gammaln(c + 1) - gammaln(rest + 1)
            chance = np.exp(ways + xlogy(b, p) + xlogy(c, q) + xlogy(rest, 1 - p - q))
            if chance > 1e-6:
                found = difference(b, c, n)
                covered += chance * (found.low <= p - q <= found.high)
    assert covered >= 0.95


def test_a_difference_is_antisymmetric_and_shrinks_with_the_episodes() -> None:
    one, other = difference(7, 2, 1000), difference(2, 7, 1000)
    assert (one.value, one.low, one.high) == pytest.approx((0.005, -other.high, -other.low))
    more = difference(700, 200, 100_000)
    assert more.high - more.low < (one.high - one.low) / 5
    none = difference(0, 0, 1000)
    assert none.low < 0 < none.high < 0.005


def test_the_limit_of_a_weighted_mean_without_hits_is_the_ceilings() -> None:
    found = weighted(0, 1000, 0.0, 0.0, 1.0, 1e-6)
    assert (found.value, found.low, found.trusted) == (0.0, 0.0, False)
    assert found.high == pytest.approx(1e-6 * proportion(0, 1000).high)
    assert "more episodes" in found.advice


def test_one_dominant_weight_is_not_trusted() -> None:
    values = np.array([1.0, *[1e-6] * 999])
    found = weighted(1000, 1000, values.sum(), (values**2).sum(), 1.0, 1.0)
    assert not found.trusted
    assert found.effective_samples == pytest.approx(1.0, abs=0.01)
    assert found.high >= proportion(1000, 1000).high


def test_small_weights_are_not_trusted_while_large_ones_may_have_been_missed() -> None:
    unseen = weighted(1000, 1000, 1.0, 1e-3, 1.0, ceiling=1.0)
    assert unseen.effective_samples == pytest.approx(1000)
    assert not unseen.trusted
    assert weighted(1000, 1000, 1.0, 1e-3, 1.0, ceiling=1e-3).trusted


def test_weighted_intervals_are_no_narrower_than_those_of_the_share_of_hits() -> None:
    every, counted = weighted(1000, 1000, 1000.0, 1000.0, 1.0, 1.0), proportion(1000, 1000)
    assert (every.standard_error, every.low, every.high) == (0.0, counted.low, 1.0)


def test_weighted_means_do_not_depend_on_the_unit() -> None:
    one = weighted(500, 1000, 400.0, 350.0, 1.0, 1.0)
    tiny = weighted(500, 1000, 400.0, 350.0, 1e-200, 1e-200)
    assert tiny.value == pytest.approx(1e-200 * one.value)
    assert tiny.standard_error == pytest.approx(1e-200 * one.standard_error)
    assert one.standard_error == pytest.approx(np.sqrt((0.35 - 0.16) / 999))


def test_repetitions_that_scatter_are_not_trusted() -> None:
    plain = Estimate(0, 100, 0.0, 0.036)
    close = repeated(np.array([1.0, 1.1, 0.9, 1.0]) * 1e-6, plain)
    assert close.trusted
    assert close.standard_error == pytest.approx(np.std([1.0, 1.1, 0.9, 1.0], ddof=1) / 2 * 1e-6)
    apart = repeated(np.array([1.0, 0.0, 0.0, 0.0]) * 1e-6, plain)
    assert (apart.trusted, apart.low, apart.high) == (False, 0.0, 0.036)
    assert "more episodes" in apart.advice
    none = repeated(np.zeros(4), plain)
    assert (none.value, none.high, none.trusted) == (0.0, 0.036, False)


def test_what_was_counted_is_trusted_unless_there_is_advice() -> None:
    plain = proportion(20, 100)
    found = counted(plain)
    assert (found.value, found.low, found.high) == (0.2, plain.low, plain.high)
    assert (found.standard_error, found.effective_samples) == (pytest.approx(0.04), 20)
    assert found.trusted
    assert not counted(plain, "look again").trusted


def test_an_average_is_no_surer_than_its_parts() -> None:
    sure = RareEstimate(4e-6, 3.8e-6, 4.2e-6, 1e-7, 1600, True)
    vague = RareEstimate(1e-9, 0.0, 1e-3, 1e-9, 1, False, "ask for more")
    both = averaged([sure, sure])
    assert both.value == pytest.approx(4e-6)
    assert both.standard_error == pytest.approx(1e-7 / np.sqrt(2))
    assert both.trusted
    assert averaged([sure]) is sure
    mixed = averaged([sure, vague])
    assert (mixed.trusted, mixed.advice) == (False, "ask for more")
    assert mixed.high >= 5e-4
    fair = RareEstimate(4e-6, 2.7e-6, 9e-4, 6e-7, 44, False, "ask for more")
    assert averaged([sure, fair]).trusted
    assert averaged([sure, fair]).high < 5e-6
