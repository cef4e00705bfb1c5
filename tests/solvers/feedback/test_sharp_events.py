"""Probabilities of crashes in one step, against the environment's own test and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from scipy.special import ndtr

from ppg_env import InputError, Polytope
from ppg_env import tolerances as tol
from ppg_env.game.compiled_margins import crossing, inside
from ppg_env.risk.overlap import log_overlap
from solvers.feedback.events.sharp_events import overlap_probability, swept_probability
from tests.marks import first

SAMPLES = 20_000
SETS = {
    "line": Polytope.box([6.0]),
    "box": Polytope.box([6.0, 4.0]),
    "l1": Polytope.l1(4.0),
    "disc": Polytope.disc(3.0, 40),
    "triangle": Polytope.from_vertices([[1.0, 0.0], [5.0, 1.0], [2.0, 4.0]]),
    "cube": Polytope.box([6.0, 4.0, 5.0]),
    "octahedron": Polytope.l1(4.0, 3),
}


@njit
def hits(axes, before, after, normals, depths):  # type: ignore[no-untyped-def]
    """Return which displacements overlap, and which steps meet the set, as the environment says."""
    overlaps, crossings = np.zeros(len(after), np.bool_), np.zeros(len(after), np.bool_)
    for c in range(len(after)):
        overlaps[c] = inside(axes, after, c, 0, -1, normals, depths, 0, len(depths))
        crossings[c] = crossing(axes, before, after, c, 0, -1, normals, depths, 0, len(depths))
    return overlaps, crossings


def environment(collision: Polytope, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    before = np.broadcast_to(before, after.shape).copy()
    depths = collision.offsets - tol.LENGTH
    axes = (0,) * collision.dim
    return np.array(hits(axes, before[:, None], after[:, None], collision.normals, depths))


def roots(d: int) -> dict[str, np.ndarray]:
    """Independent, correlated, flat and no noise."""
    mixed = np.random.default_rng(d).normal(size=(d, d)) + np.eye(d)
    flat = mixed.copy()
    flat[:, 0] = 0.0
    return {
        "independent": np.diag(1.0 + np.arange(d)),
        "correlated": mixed,
        "flat": flat,
        "one axis": np.diag([1.5] + [0.0] * (d - 1)),
        "none": np.zeros((d, d)),
    }


@pytest.mark.parametrize(
    "kind", first(2, ["correlated", "none", "independent", "flat", "one axis"])
)
@pytest.mark.parametrize("name", SETS)
def test_frequencies_in_the_environment_are_the_probabilities(name: str, kind: str) -> None:
    collision = SETS[name]
    d, root = collision.dim, roots(collision.dim)[kind]
    random = np.random.default_rng(7)
    means = random.uniform(-6, 6, (12, d))
    starts = random.uniform(-8, 8, (12, d))
    starts[0] = collision.vertices[0]
    starts[1] = collision.vertices[:d].mean(axis=0)
    covariance = root @ root.T
    overlap = overlap_probability(collision, means, covariance)
    swept = swept_probability(collision, starts, means, covariance)
    assert (overlap <= swept + 1e-12).all()
    for k in range(len(means)):
        after = means[k] + random.normal(size=(SAMPLES, d)) @ root.T
        frequencies = environment(collision, starts[k], after).mean(axis=1)
        for frequency, p in zip(frequencies, (overlap[k], swept[k]), strict=True):
            assert abs(frequency - p) <= 4.5 * np.sqrt(p * (1 - p) / SAMPLES) + 1e-4 * (p % 1 > 0)


@pytest.mark.parametrize("name", ["box", "l1", "disc", "triangle"])
def test_the_plane_agrees_with_the_integrals_of_the_risk_package(name: str) -> None:
    collision, covariance = SETS[name], np.array([[2.0, 0.7], [0.7, 1.0]])
    means = np.random.default_rng(1).uniform(-9, 9, (500, 2))
    exact = np.exp(log_overlap(collision, means, np.broadcast_to(covariance, (500, 2, 2))))
    assert overlap_probability(collision, means, covariance, touch=0.0) == pytest.approx(
        exact, abs=1e-12
    )


def test_a_start_on_a_face_sees_a_half_plane_and_one_on_a_corner_a_wedge() -> None:
    box, means = SETS["box"], np.random.default_rng(2).uniform(-5, 5, (50, 2))
    face = swept_probability(box, np.array([3.0, 0.5]), means, np.eye(2))
    assert face == pytest.approx(ndtr(3.0 - means[:, 0]), abs=2e-6)
    corner = swept_probability(box, np.array([3.0, 2.0]), means, np.eye(2))
    assert corner == pytest.approx(ndtr(3.0 - means[:, 0]) * ndtr(2.0 - means[:, 1]), abs=3e-6)


def test_what_a_set_hides_is_a_wedge_less_a_triangle() -> None:
    # From (-5, 0), the box hides the points between the lines of slope 1 through (-3, 2) and -1
    # through (-3, -2), right of x = -3.  The mean at the apex: a quarter less the triangle.
    value = swept_probability(SETS["box"], [-5.0, 0.0], [-5.0, 0.0], np.eye(2))
    apex = Polytope.from_vertices([[-5.0, 0.0], [-3.0, -2.0], [-3.0, 2.0]])
    triangle = overlap_probability(apex, np.array([-5.0, 0.0]), np.eye(2), touch=0.0)
    assert float(value) == pytest.approx(0.25 - float(triangle), abs=2e-6)


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_units_do_not_matter(scale: float) -> None:
    means, starts = np.random.default_rng(3).uniform(-6, 6, (2, 40, 2))
    plain = swept_probability(SETS["disc"], starts, means, np.eye(2))
    scaled = swept_probability(
        Polytope.disc(3.0 * scale, 40),
        starts * scale,
        means * scale,
        scale**2 * np.eye(2),
        touch=tol.LENGTH * scale,
    )
    assert scaled == pytest.approx(plain, abs=1e-11)


def test_shapes_follow_the_means_and_starts_are_broadcast() -> None:
    starts, means = np.zeros((3, 1, 2)) + 9.0, np.zeros((4, 2))
    assert swept_probability(SETS["box"], starts, means, np.eye(2)).shape == (3, 4)
    assert overlap_probability(SETS["box"], means[0], np.eye(2)).shape == ()


def test_a_body_that_is_all_rim_is_never_hit() -> None:
    tiny = Polytope.disc(5e-7, 6)
    assert overlap_probability(tiny, np.zeros((1, 2)), np.eye(2) * 1e-14)[0] == 0.0
    assert swept_probability(tiny, np.zeros((1, 2)), np.zeros((1, 2)), np.eye(2))[0] == 0.0


def test_more_than_three_dimensions_are_refused_in_words() -> None:
    with pytest.raises(InputError, match="at most 3"):
        swept_probability(Polytope.box([1.0] * 4), np.ones(4), np.ones(4), np.eye(4))
