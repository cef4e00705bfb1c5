"""The pieces of the proof of lower bounds: minima over polygons, functions below expectations."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.feedback.bounds.gaussian_axis import Axis, NoAxis
from solvers.feedback.bounds.grid_rim import SoloProblem
from solvers.feedback.bounds.polygon_minimum import minima_at_fixed_offsets, minima_at_images
from solvers.feedback.bounds.solo_grid import SoloGrid

POLYGONS = {
    "diamond": np.array([[2.3, 0.0], [0.0, 2.3], [-2.3, 0.0], [0.0, -2.3]]),
    "triangle": np.array([[0.2, 0.1], [3.4, 0.7], [1.1, 2.9]]),
    "segment": np.array([[-1.7, -0.4], [1.3, 2.2]]),
    "point": np.array([[0.4, -0.7]]),
}


def triangular(w: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the piecewise linear function at points (K, 2), infinity off the mesh."""
    off = ((points < 0) | (points > np.array(w.shape) - 1)).any(axis=1)
    places = np.where(off[:, None], 0.0, points)
    corner = np.minimum(places.astype(int), np.array(w.shape) - 2)
    (x, y), (i, j) = (places - corner).T, corner.T
    lower = w[i, j] + x * (w[i + 1, j] - w[i, j]) + y * (w[i + 1, j + 1] - w[i + 1, j])
    upper = w[i, j] + y * (w[i, j + 1] - w[i, j]) + x * (w[i + 1, j + 1] - w[i, j + 1])
    return np.where(off, np.inf, np.where(x >= y, lower, upper))


def samples(polygon: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return points of the polygon, most of them on its sides."""
    shares = random.dirichlet(np.full(len(polygon), 0.4), 3000)
    return np.vstack([shares @ polygon, polygon])


@pytest.mark.parametrize("name", POLYGONS)
def test_the_minimum_over_a_polygon_is_attained_and_never_undercut(name: str) -> None:
    random, polygon = np.random.default_rng(3), POLYGONS[name]
    w = random.normal(size=(9, 8))
    fixed, image = np.empty_like(w), np.empty_like(w)
    minima_at_fixed_offsets(w, polygon, fixed)
    minima_at_images(w, polygon, np.zeros(2), np.eye(2), image)
    assert fixed == pytest.approx(image, abs=1e-7)
    inner = samples(polygon, random)
    for i, j in np.ndindex(*w.shape):
        least = triangular(w, inner + np.array([i, j])).min()
        if np.isfinite(least):
            assert image[i, j] <= least + 1e-9
            assert image[i, j] >= least - 0.35


def problem(plane: bool, inside: float = 0.0) -> SoloProblem:
    x = Axis(-4.0, 0.3, 31, 1.0, (10, 16))
    y = Axis(-3.0, 0.25, 25, 0.8, (9, 14)) if plane else NoAxis()
    return SoloProblem(
        A=np.eye(2) if plane else np.diag([1.0, 0.0]),
        moves=((0, np.array([[-1.0, 0.0], [1.0, 0.0]])),),
        slopes=np.zeros((1, 2)),
        axes=(x, y),
        leave=10.0,
        steps=5,
        pulls=np.zeros((0, 2)),
        short=np.zeros(0),
        inside=inside,
    )


@pytest.mark.parametrize("plane", [True, False])
@pytest.mark.parametrize("inside", [0.0, 6.0])
def test_between_nodes_the_table_stays_below_the_expectation(plane: bool, inside: float) -> None:
    task, random = problem(plane, inside), np.random.default_rng(5)
    grid = SoloGrid(task)
    value, outside = random.uniform(0.0, 4.0, task.shape), 1.3
    below = grid.after(value, outside)
    x, y = task.axes
    means = np.column_stack([random.uniform(-4, 5, 400), random.uniform(-3, 3, 400)])
    for mean in means:
        rows = [x.start(mean[0], x.sigma, arrived=False), y.start(mean[1], y.sigma, arrived=False)]
        goal = [x.start(mean[0], x.sigma, arrived=True), y.start(mean[1], y.sigma, arrived=True)]
        arrived = goal[0].sum() * goal[1].sum()
        exact = rows[0] @ value @ rows[1] - goal[0] @ value @ goal[1] + inside * arrived
        exact += outside * (1.0 - rows[0].sum() * rows[1].sum())
        hats = [axis.start(m, 0.0, arrived=False) for axis, m in zip(task.axes, mean, strict=True)]
        assert hats[0] @ below @ hats[1] <= exact + 1e-12
        if plane:
            place = (mean - (x.low, y.low)) / (x.spacing, y.spacing)
            assert triangular(below, place[None])[0] <= exact + 1e-12


def test_expectations_of_hats_and_their_derivatives_are_those_of_quadrature() -> None:
    axis = Axis(-1.0, 0.5, 9, 0.7, (2, 5))
    nodes, weights = np.polynomial.hermite_e.hermegauss(180)
    shift = 1e-4

    def hats(mean: float) -> np.ndarray:
        return axis.start(mean, axis.sigma, arrived=False)

    for k, mean in enumerate(axis.nodes):
        places = (mean + axis.sigma * nodes - axis.low) / axis.spacing
        values = np.maximum(0.0, 1.0 - np.abs(places[:, None] - np.arange(axis.count)))
        values[(places < 0) | (places > axis.count - 1)] = 0.0
        rough = weights @ values / weights.sum()
        assert axis.everywhere[0][k] == pytest.approx(rough, abs=0.03)
        up, here, down = hats(mean + shift), hats(mean), hats(mean - shift)
        assert axis.everywhere[0][k] == pytest.approx(here, abs=1e-13)
        assert axis.everywhere[1][k] == pytest.approx((up - down) / (2 * shift), abs=1e-6)
        assert axis.everywhere[2][k] == pytest.approx((up - 2 * here + down) / shift**2, abs=1e-5)
