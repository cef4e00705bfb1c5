from __future__ import annotations

import numpy as np
import pytest

from solvers.feedback.grid.cubic import gaussian_weights, point_weights
from tests.marks import first

POINTS = np.arange(40) * 0.5 - 3.0
MIDDLE = np.array([2.0, 4.5, 7.25, 8.1])


def keys(s: np.ndarray) -> np.ndarray:
    """The kernel as Keys gives it."""
    s = np.abs(s)
    near, far = 1.5 * s**3 - 2.5 * s**2 + 1, -0.5 * s**3 + 2.5 * s**2 - 4 * s + 2
    return np.where(s < 1, near, np.where(s < 2, far, 0.0))


def test_weights_at_points_are_the_kernel():
    weights = point_weights(-3.0, 0.5, 40, MIDDLE)
    assert weights == pytest.approx(keys((MIDDLE[:, None] - POINTS) / 0.5), abs=1e-12)


@pytest.mark.parametrize("within", first(2, [(-np.inf, np.inf), (3.0, 4.6), (7.3, np.inf)]))
@pytest.mark.parametrize("deviation", first(1, [0.4, 0.03, 1.1]))
def test_weights_are_the_integrals_of_the_kernel(deviation, within):
    weights = gaussian_weights(-3.0, 0.5, 40, MIDDLE, deviation, within)
    x = np.linspace(-2.9, 16.4, 80_001)
    for mean, row in zip(MIDDLE, weights, strict=True):
        density = np.exp(-0.5 * ((x - mean) / deviation) ** 2) / deviation / np.sqrt(2 * np.pi)
        density *= (x >= within[0]) & (x <= within[1])
        exact = [np.sum(density * keys((x - p) / 0.5)) * (x[1] - x[0]) for p in POINTS[8:28]]
        assert row[8:28] == pytest.approx(exact, abs=2e-3)


def test_expectations_of_quadratics_are_exact():
    weights = gaussian_weights(-3.0, 0.5, 40, MIDDLE, 0.9)
    assert weights @ POINTS**2 == pytest.approx(MIDDLE**2 + 0.81, rel=1e-6)


def test_without_noise_the_interval_is_all_or_nothing():
    weights = gaussian_weights(-3.0, 0.5, 40, MIDDLE, 0.0, (4.0, 7.5))
    assert weights.sum(axis=1) == pytest.approx([0, 1, 1, 0])


def test_beyond_the_border_values_continue():
    weights = gaussian_weights(-3.0, 0.5, 40, np.array([-3.0, 16.5]), 1.0)
    assert weights.sum(axis=1) == pytest.approx([1, 1])
