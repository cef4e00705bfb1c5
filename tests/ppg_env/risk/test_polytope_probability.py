"""Standard normal probabilities of intervals, polygons and polyhedra, in logarithms."""

from __future__ import annotations

from itertools import product

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env.risk.overlap import surface
from ppg_env.risk.polytope_probability import log_interval, log_polygon, log_polyhedron
from tests.ppg_env.strategies import hulls

SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
CUBE = np.array(list(product((-1.0, 1.0), repeat=3)))
PLACES = st.floats(-30, 30)
SIZES = st.floats(0.01, 1000.0)


def exact_interval(low: float, high: float) -> mpmath.mpf:
    """Pr(low < z < high) with 40 digits."""
    with mpmath.workdps(40):
        scale = mpmath.sqrt(2)
        if high < 0:
            low, high = -high, -low
        if low > 0:
            return (mpmath.erfc(low / scale) - mpmath.erfc(high / scale)) / 2
        return (mpmath.erf(high / scale) - mpmath.erf(low / scale)) / 2


@pytest.mark.parametrize(
    ("low", "high"),
    [(-1, 1), (0, 1e-9), (1e-3, 2e-3), (3, 3.001), (7.9, 50), (-50, -37), (-9, 30), (200, 201)],
)
def test_intervals_are_exact_in_both_tails(low: float, high: float) -> None:
    with mpmath.workdps(40):
        exact = float(mpmath.log(exact_interval(low, high)))
    assert log_interval(np.array(low), np.array(high)) == pytest.approx(exact, rel=1e-12, abs=1e-12)
    assert log_interval(np.array(-high), np.array(-low)) == pytest.approx(exact, rel=1e-12)


def test_an_empty_interval_has_no_probability() -> None:
    assert np.isneginf(log_interval(np.array([1.0, 2.0]), np.array([1.0, 1.0]))).all()


def box_log(centre: np.ndarray, half: np.ndarray) -> float:
    return float(log_interval(centre - half, centre + half).sum())


@given(st.tuples(PLACES, PLACES), st.tuples(SIZES, SIZES), st.floats(0, 7), st.booleans())
def test_turned_boxes_in_the_plane_are_products(
    place: tuple[float, ...], size: tuple[float, ...], angle: float, clockwise: bool
) -> None:
    centre, half = np.array(place), np.array(size) / 2
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = (centre + half * SQUARE) @ turn.T
    found = log_polygon(corners[None, :: -1 if clockwise else 1])[0]
    assert found == pytest.approx(box_log(centre, half), rel=1e-10, abs=1e-9)


def cube_triangles() -> np.ndarray:
    from ppg_env import Polytope

    return surface(Polytope.box([2.0, 2.0, 2.0]))


@given(
    st.lists(PLACES, min_size=3, max_size=3),
    st.lists(SIZES, min_size=3, max_size=3),
    st.integers(0, 1000),
)
def test_turned_boxes_in_space_are_products(
    place: list[float], size: list[float], seed: int
) -> None:
    centre, half = np.array(place), np.array(size) / 2
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    found = log_polyhedron(((centre + half * CUBE) @ turn.T)[None], cube_triangles())[0]
    assert found == pytest.approx(box_log(centre, half), rel=1e-10, abs=1e-7)


@pytest.mark.parametrize("place", list(product((0.0, 0.5, 2.0, 6.0), repeat=3)), ids=str)
def test_the_origin_may_lie_on_faces_edges_and_corners(place: tuple[float, ...]) -> None:
    centre, half = np.array(place), np.array([0.5, 2.0, 6.0])
    found = log_polyhedron((centre + half * CUBE)[None], cube_triangles())[0]
    assert found == pytest.approx(box_log(centre, half), abs=1e-10)
    flat = log_polygon((centre[:2] + half[:2] * SQUARE)[None])[0]
    assert flat == pytest.approx(box_log(centre[:2], half[:2]), abs=1e-10)


@given(hulls(2), st.tuples(PLACES, PLACES))
def test_a_polygon_is_the_sum_of_its_triangles(hull, place: tuple[float, float]) -> None:
    corners = hull.vertices + np.array(place)
    fan = [log_polygon(corners[None, [0, k, k + 1]])[0] for k in range(1, len(corners) - 1)]
    whole = log_polygon(corners[None])[0]
    assert np.logaddexp.reduce(fan) == pytest.approx(whole, rel=1e-10, abs=1e-9)


@given(hulls(3), st.tuples(PLACES, PLACES, PLACES))
def test_a_polyhedron_is_the_sum_of_its_tetrahedra(hull, place: tuple[float, ...]) -> None:
    corners, triangles = hull.vertices + np.array(place), surface(hull)
    tetrahedron = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    parts = []
    for a, b, c in triangles:
        if 0 not in (a, b, c):
            four = corners[[a, b, c, 0]]
            if abs(np.linalg.det(four[:3] - four[3])) > 1e-9:
                parts.append(log_polyhedron(four[None], tetrahedron)[0])
    whole = log_polyhedron(corners[None], triangles)[0]
    assert np.logaddexp.reduce(parts) == pytest.approx(whole, rel=1e-9, abs=1e-7)


def test_nothing_is_too_small_for_a_logarithm() -> None:
    """At 1000 deviations from a wide face: log phi(1000) - log 1000."""
    corners = np.array([1050.0, 0.0]) + 50 * SQUARE
    expected = -(1000.0**2) / 2 - np.log(np.sqrt(2 * np.pi) * 1000) + np.log1p(-1e-6)
    assert log_polygon(corners[None])[0] == pytest.approx(expected, abs=1e-8)
