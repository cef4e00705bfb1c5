"""Lower bounds on the probability that two displacements both overlap."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from ppg_env import Polytope
from ppg_env.risk.joint_bounds import log_joint_bound, log_joint_tails
from ppg_env.risk.overlap import log_overlap
from ppg_env.support.statistics import proportion
from tests.marks import first
from tests.ppg_env.strategies import bodies, covariances

BOX, HEXAGON = Polytope.box([6.0, 4.0]), Polytope.disc(3.5, 6)


def bound(
    sets: tuple[Polytope, Polytope], means: tuple[list[float], list[float]], joint: np.ndarray
) -> float:
    """Log of the bound, for X and Y stacked with covariance ``joint`` (2d, 2d)."""
    d = sets[0].dim
    places = tuple(np.array([mean], dtype=float) for mean in means)
    spreads = joint[None, :d, :d], joint[None, d:, d:]
    return float(log_joint_bound(sets, places, spreads, joint[None, :d, d:])[0])


def stacked(rho: float, dim: int = 2) -> np.ndarray:
    """Unit covariances, and correlation ``rho`` axis by axis."""
    return np.kron([[1.0, rho], [rho, 1.0]], np.eye(dim))


@pytest.mark.parametrize("rho", [-0.7, 0.0, 0.3, 0.95, 1 - 1e-6])
@pytest.mark.parametrize("mean", [3.5, 5.0])
def test_boxes_with_independent_axes_are_exact(rho: float, mean: float) -> None:
    found = bound((BOX, BOX), ([mean, 1.0], [mean + 0.5, 0.5]), stacked(rho))
    exact = 1.0
    for place, half in zip(([mean, mean + 0.5], [1.0, 0.5]), (3.0, 2.0), strict=True):
        pair = multivariate_normal(place, [[1, rho], [rho, 1]], allow_singular=True)
        exact *= pair.cdf([half, half], lower_limit=[-half, -half])
    assert np.exp(found) == pytest.approx(exact, rel=1e-4)
    assert np.exp(found) <= exact * (1 + 1e-6)


@pytest.mark.parametrize("gap", [0.0, 1e-13, 1e-11, 1e-9])
@pytest.mark.parametrize("body", [BOX, HEXAGON], ids=["box", "hexagon"])
def test_the_same_displacement_twice_is_one_event(body: Polytope, gap: float) -> None:
    found = bound((body, body), ([5.0, 1.0], [5.0, 1.0]), stacked(1 - gap))
    single = float(log_overlap(body, np.array([[5.0, 1.0]]), np.eye(2)[None])[0])
    assert found <= single
    assert np.exp(found - single) > (1 - 1e-3 if body is BOX else 0.8)


def test_the_same_displacement_in_two_sets_that_only_touch_is_next_to_impossible() -> None:
    other = Polytope.from_vertices(BOX.vertices + np.array([6.0, 0.0]))
    assert np.isneginf(bound((BOX, other), ([3.0, 0.0], [3.0, 0.0]), stacked(1.0)))


def test_independent_boxes_multiply() -> None:
    means = ([6.0, 3.0], [-7.0, 1.0])
    single = sum(float(log_overlap(BOX, np.array([mean]), np.eye(2)[None])[0]) for mean in means)
    assert bound((BOX, BOX), means, stacked(0.0)) == pytest.approx(single, abs=1.1e-6)


def test_far_out_it_stays_a_number() -> None:
    found = bound((BOX, BOX), ([60.0, 0.0], [61.0, 0.0]), stacked(0.9))
    assert np.isfinite(found)
    assert found < -1000


@pytest.mark.parametrize(("rho", "least"), [(0.5, 0.7), (0.9, 0.7), (0.99, 0.7)])
@pytest.mark.parametrize("mean", first(1, [[4.5, 0.5], [4.0, 3.0], [0.0, 4.5]]))
def test_other_polygons_lose_little(rho: float, least: float, mean: list[float]) -> None:
    found = np.exp(bound((HEXAGON, HEXAGON), (mean, mean), stacked(rho)))
    random, count = np.random.default_rng(7), 400_000
    x = random.standard_normal((count, 2))
    y = rho * x + np.sqrt(1 - rho**2) * random.standard_normal((count, 2))
    both = (HEXAGON.clearance(x + mean) < 0) & (HEXAGON.clearance(y + mean) < 0)
    counted = proportion(int(both.sum()), count, 1 - 1e-6)
    assert found <= counted.high
    assert found >= least * counted.low


@given(
    st.integers(2, 3).flatmap(lambda d: st.tuples(bodies(d), bodies(d), covariances(2 * d))),
    st.floats(-6, 6),
    st.integers(0, 99),
)
def test_it_never_exceeds_what_is_counted(data, place: float, seed: int) -> None:
    one, two, joint = data
    mean, count = np.full(one.dim, place), 3000
    found = np.exp(bound((one, two), (mean.tolist(), mean.tolist()), joint))
    sample = np.random.default_rng(seed).multivariate_normal(np.tile(mean, 2), joint, count)
    both = (one.clearance(sample[:, : one.dim]) < 0) & (two.clearance(sample[:, one.dim :]) < 0)
    assert found <= proportion(int(both.sum()), count, 1 - 1e-9).high
    single = log_overlap(one, mean[None], joint[None, : one.dim, : one.dim])[0]
    assert found <= np.exp(single) * (1 + 1e-9)


@pytest.mark.parametrize("rho", [-0.8, 0.0, 0.5, 0.9, 0.999, 1.0])
@pytest.mark.parametrize("levels", [(0.5, 0.5), (2.0, 3.0), (-1.0, 2.0), (3.0, 3.0)])
def test_joint_tails_are_those_of_a_bivariate_normal(
    rho: float, levels: tuple[float, float]
) -> None:
    pair = multivariate_normal([0, 0], [[1, rho], [rho, 1]], allow_singular=True)
    exact = pair.cdf([-levels[0], -levels[1]])
    found = np.exp(log_joint_tails(np.array([rho]), *(np.array([level]) for level in levels))[0])
    assert found == pytest.approx(exact, rel=2e-4, abs=1e-12)
    assert found <= exact * (1 + 1e-6) + 1e-12
