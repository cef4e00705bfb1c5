"""Probability that a Gaussian displacement lies in a collision set."""

from __future__ import annotations

from itertools import pairwise

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import log_ndtr

from ppg_env import InputError, Polytope
from ppg_env.game.hulls import corners_of_points
from ppg_env.risk.overlap import log_best_face, log_overlap
from ppg_env.risk.polytope_probability import log_interval
from tests.marks import first
from tests.ppg_env.strategies import bodies, covariances

TURN = np.array([[1.0, -1.0], [1.0, 1.0]]) / np.sqrt(2)
"""By 45 degrees."""


def one(collision: Polytope, mean: object, covariance: object) -> float:
    return float(log_overlap(collision, np.array([mean], float), np.array([covariance], float))[0])


def oracle(collision: Polytope, mean: np.ndarray, covariance: np.ndarray) -> mpmath.mpf:
    """Integral over x of its density times the conditional chord, with 30 digits."""
    with mpmath.workdps(30):
        (a, b), (_, c) = covariance.tolist()
        first, spread = mpmath.sqrt(a), mpmath.sqrt(mpmath.mpf(c) - mpmath.mpf(b) ** 2 / a)

        def slice_at(x: mpmath.mpf) -> mpmath.mpf:
            low, high = mpmath.mpf("-inf"), mpmath.mpf("inf")
            for (p, q), offset in zip(collision.normals, collision.offsets, strict=True):
                if abs(q) > 1e-12:
                    end = (offset - p * x) / q
                    low, high = (low, min(high, end)) if q > 0 else (max(low, end), high)
            centre = mean[1] + mpmath.mpf(b) / a * (x - mean[0])
            ends = [(end - centre) / spread / mpmath.sqrt(2) for end in (low, high)]
            if ends[0] > 0:
                return (mpmath.erfc(ends[0]) - mpmath.erfc(ends[1])) / 2
            return (mpmath.erfc(-ends[1]) - mpmath.erfc(-ends[0])) / 2

        knots = sorted(set(collision.vertices[:, 0].tolist()))
        fine = np.concatenate([np.linspace(p, q, 9) for p, q in pairwise(knots)])
        return mpmath.quad(lambda x: mpmath.npdf(x, mean[0], first) * slice_at(x), fine)


@pytest.mark.parametrize("distance", [5.0, 20.0, 40.0, 55.0, 300.0])
def test_two_boxes_with_independent_axes_are_right_to_eight_digits(distance: float) -> None:
    box, spread = Polytope.box([30.0, 20.0]), (3.0, 2.0)
    with mpmath.workdps(40):

        def axis(half: float, mean: float, sigma: float) -> mpmath.mpf:
            ends = [(mean - half) / sigma, (mean + half) / sigma]
            scaled = [mpmath.mpf(end) / mpmath.sqrt(2) for end in ends]
            return (mpmath.erfc(scaled[0]) - mpmath.erfc(scaled[1])) / 2

        exact = mpmath.log(axis(15.0, distance, 3.0) * axis(10.0, 4.0, 2.0))
    found = one(box, [distance, 4.0], np.diag(np.square(spread)))
    assert abs(found - float(exact)) <= max(1e-8, 1e-14 * abs(float(exact)))


@pytest.mark.parametrize("deviations", [1.0, 4.0, 7.0, 8.0, 30.0])
def test_a_wide_set_is_a_half_plane(deviations: float) -> None:
    wall = Polytope.from_vertices([[0, -2e3], [-2e3, -2e3], [-2e3, 2e3], [0, 2e3]])
    covariance = [[4.0, 1.0], [1.0, 9.0]]
    found = one(wall, [2 * deviations, 3.0], covariance)
    assert found == pytest.approx(log_ndtr(-deviations), rel=1e-9)


@pytest.mark.parametrize("distance", [0.0, 20.0, 30.0, 37.0, 50.0])
def test_a_case_turned_by_45_degrees_agrees_with_the_box(distance: float) -> None:
    box, mean = Polytope.box([30.0, 20.0]), np.array([distance, 8.0])
    turned = Polytope.from_vertices(box.vertices @ TURN.T)
    covariance = np.diag([6.0, 2.0])
    found = one(turned, TURN @ mean, TURN @ covariance @ TURN.T)
    straight = one(box, mean, covariance)
    assert found == pytest.approx(straight, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("seed", first(1, range(6)))
def test_any_polygon_and_noise_agree_with_nested_integrals(seed: int) -> None:
    random = np.random.default_rng(seed)
    hull = Polytope.from_vertices(corners_of_points(random.normal(size=(7, 2)) * 6))
    root = random.normal(size=(2, 2))
    mean = random.normal(size=2) * (4.0, 8.0, 16.0)[seed % 3]
    exact = oracle(hull, mean, root @ root.T + 0.5 * np.eye(2))
    found = one(hull, mean, root @ root.T + 0.5 * np.eye(2))
    assert exact > 1e-60
    assert np.exp(found) == pytest.approx(float(exact), rel=1e-8)


@given(bodies(), covariances(2), st.tuples(st.floats(-60, 60), st.floats(-60, 60)))
def test_it_is_positive_below_the_best_face_and_below_one(body, covariance, mean) -> None:
    found = one(body, mean, covariance)
    face = log_best_face(body, np.array([mean]), covariance[None])[0]
    assert np.isfinite(found)
    assert found <= min(face, 0.0)


@given(bodies(3), covariances(3), st.lists(st.floats(-60, 60), min_size=3, max_size=3))
def test_in_space_too(body, covariance, mean) -> None:
    found = one(body, mean, covariance)
    assert np.isfinite(found)
    assert found <= log_best_face(body, np.array([mean]), covariance[None])[0]


def test_without_noise_it_is_decided_and_touching_is_no_overlap() -> None:
    box, tilted = Polytope.box([2.0, 2.0]), Polytope.l1(1.0)
    still = np.zeros((2, 2))
    for body in (box, tilted):
        assert one(body, [0.5, 0.2], still) == 0.0
        assert np.isneginf(one(body, [1.0, 0.0], still))
        assert np.isneginf(one(body, [3.0, 0.0], still))


def test_noise_along_a_line_only_is_an_interval() -> None:
    direction = np.array([1.0, 1.0])
    found = one(Polytope.l1(2.0), [3.0, 3.0], np.outer(direction, direction))
    assert found == pytest.approx(float(log_interval(np.array(-4.0), np.array(-2.0))))
    assert np.isneginf(one(Polytope.l1(2.0), [3.0, 0.0], np.outer(direction, direction)))
    flat = np.diag([4.0, 0.0])
    box = Polytope.box([4.0, 4.0])
    assert one(box, [4.0, 1.0], flat) == pytest.approx(
        float(log_interval(np.array(1.0), np.array(3.0)))
    )
    assert np.isneginf(one(box, [4.0, 2.0], flat))


def test_noise_in_a_plane_only_cuts_a_polygon() -> None:
    """A tilted plane through a prism, against the same prism with a little noise across."""
    base = [[0, 0], [4, 0], [1, 3]]
    prism = Polytope.from_vertices([[x, y, z] for x, y in base for z in (-9, 9)])
    root = np.array([[1.0, 0.2], [0.0, 1.5], [0.5, 0.3]])
    mean, across = [6.0, 2.0, 1.0], np.cross(root[:, 0], root[:, 1])
    flat = one(prism, mean, root @ root.T)
    thick = one(prism, mean, root @ root.T + 1e-8 * np.outer(across, across))
    assert flat == pytest.approx(thick, rel=1e-5)
    level = np.diag([1.0, 1.0, 0.0])
    plane = Polytope.from_vertices(base)
    assert one(prism, [6, 2, 1], level) == pytest.approx(one(plane, [6, 2], np.eye(2)), rel=1e-12)
    assert np.isneginf(one(prism, [6, 2, 9], level))


def test_one_dimension_is_an_interval() -> None:
    assert one(Polytope.box([2.0]), [5.0], [[4.0]]) == pytest.approx(
        float(log_interval(np.array(2.0), np.array(3.0)))
    )


def test_four_dimensions_are_for_boxes_alone() -> None:
    box, mean = Polytope.box([2.0] * 4), [3.0, 0, 0, 0]
    found = one(box, mean, np.eye(4))
    assert found == pytest.approx(
        float(log_interval(np.array([2.0, -1, -1, -1]), np.array([4.0, 1, 1, 1])).sum())
    )
    with pytest.raises(InputError, match="dimension 4"):
        one(box, mean, np.eye(4) + 0.1)
