"""Lower bounds on unions: small cases that are known, and never above the truth or the tree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from ppg_env import make_game
from ppg_env.risk import risk_bounds
from ppg_env.risk.dawson_bounds import log_joint_tails_above, log_union_bound
from ppg_env.risk.lower_bounds import lower_bounds
from tests.oracles.plain_monte_carlo import case, counted, fly
from tests.ppg_env.strategies import Play, plays
from tests.profiles import examples

OUTCOMES = st.lists(st.lists(st.booleans(), min_size=4, max_size=4), min_size=6, max_size=6)


def dawson_sankoff(logs: np.ndarray, joint: np.ndarray) -> float:
    """The bound of Dawson and Sankoff, from the sums of single and of joint probabilities."""
    first, pairs = np.exp(logs).sum(), np.exp(joint)[np.triu_indices(len(logs), 1)].sum()
    k = np.arange(1, len(logs) + 2)
    return float((2 * first / (k + 1) - 2 * pairs / (k * (k + 1))).max())


def arrays(chances: np.ndarray, happens: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Single and joint probabilities of events over outcomes, sorted, and that of the union."""
    single = chances @ happens
    order = np.argsort(-single)
    happens = happens[:, order]
    joint = np.einsum("o,ok,ol->kl", chances, happens, happens)
    return single[order], joint, float(chances @ happens.any(axis=1))


@given(st.lists(st.integers(1, 9), min_size=6, max_size=6), OUTCOMES)
def test_it_holds_for_any_events_and_is_at_least_dawson_and_sankoffs(
    weights: list[int], table: list[list[bool]]
) -> None:
    chances, happens = np.array(weights) / sum(weights), np.array(table, dtype=float)
    happens[:, 0] = np.maximum(happens[:, 0], np.arange(6) == 0)
    single, joint, union = arrays(chances, happens)
    kept = single > 0
    single, joint = single[kept], joint[np.ix_(kept, kept)]
    with np.errstate(divide="ignore"):
        logs, log_joint = np.log(single), np.log(joint)
    bound = np.exp(log_union_bound(logs, log_joint))
    assert single[0] * (1 - 1e-9) <= bound <= union * (1 + 1e-9)
    assert dawson_sankoff(logs, log_joint) <= union * (1 + 1e-9)


def test_disjoint_events_add_up_and_equal_ones_do_not() -> None:
    logs = np.log([0.3, 0.2, 0.1])
    apart = np.full((3, 3), -np.inf)
    assert np.exp(log_union_bound(logs, apart)) == pytest.approx(0.6, rel=1e-5)
    assert dawson_sankoff(logs, apart) == pytest.approx(0.6)
    equal = np.full(3, np.log(0.3))
    assert np.exp(log_union_bound(equal, np.full((3, 3), np.log(0.3)))) == pytest.approx(0.3)


@given(st.floats(-1, 1), st.floats(-1, 6), st.floats(-1, 6))
def test_joint_tails_are_bounded_from_above(rho: float, first: float, second: float) -> None:
    above = float(np.exp(log_joint_tails_above(*(np.array([x]) for x in (rho, first, second))))[0])
    limited = min(max(rho, -0.999), 0.999)  # decreasing rho decreases the probability
    exact = multivariate_normal.cdf(
        [-first, -second], cov=[[1, limited], [limited, 1]], abseps=1e-12
    )
    if limited == rho:
        assert exact - 1e-9 <= above <= exact * (1 + 1e-4) + 1e-9
    elif rho > 0:
        assert above >= exact - 1e-9


@examples(0.3)
@given(plays(scale="exact"))
def test_it_lies_between_the_likeliest_instant_and_the_tree(play: Play) -> None:
    bounds = risk_bounds(play.game, play.profile)
    each, of_any = lower_bounds(play.game, play.profile, bounds)
    for low, event in zip((*each, of_any), (*bounds.agents, bounds.any), strict=True):
        assert event.least * (1 - 1e-9) <= low <= event.tree * (1 + 1e-6)


@pytest.mark.parametrize("name", ["side 1e-3", "corner 1e-4", "crowd 1e-4"])
@pytest.mark.parametrize("way", ["instants", "swept"])
def test_a_hundred_million_plain_episodes_do_not_contradict_it(name: str, way: str) -> None:
    game, profile = case(name)
    game, record = replace(game, collisions=way), counted()
    low = lower_bounds(game, profile, risk_bounds(game, profile))[1]
    hits = record["counts"][name][way]["any"]
    assert low <= (hits + 4.5 * np.sqrt(hits)) / record["samples"]
    assert low >= (0.8 if way == "instants" else 0.2) * hits / record["samples"]


def test_certain_and_impossible_crashes_have_the_bounds_one_and_zero() -> None:
    still, apart = make_game("head_on", noise=0.0), make_game("parallel", noise=0.0)
    assert lower_bounds(still, fly(still), risk_bounds(still, fly(still)))[1] == 1.0
    assert lower_bounds(apart, fly(apart), risk_bounds(apart, fly(apart))) == ((0.0, 0.0), 0.0)
