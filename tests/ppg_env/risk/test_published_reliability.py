"""Failure probabilities of published reliability problems, as overlaps of bodies.

Source: otbenchmark (OpenTURNS), which has them from the RPRepo collection: R - S, RP77 and RP107.
Two printed probabilities are estimates: 2.92e-7 for RP107 is 2 % above the exact Phi(-5), and
2.87e-7 for RP77 is 7 % above the exact value, which is an integral over x3 of one variable.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtr
from scipy.stats import norm

from ppg_env import Agent, Game, Polytope, make_plan
from ppg_env.game.obstacle import Obstacle
from ppg_env.risk import crash_counts, rare_risk, risk_bounds
from ppg_env.risk.overlap import log_overlap

FAR = 60.0


def half_spaces(normals: list, offsets: list, centre: list) -> Polytope:
    """Return {x : normals x <= offsets} within a cube that holds nearly all of the mass."""
    cube = np.concatenate([np.eye(3), -np.eye(3)])
    edges = np.concatenate([np.add(centre, 15), -np.subtract(centre, 15)])
    return Polytope.from_halfspaces(
        np.concatenate([normals, cube]), np.concatenate([offsets, edges])
    )


def test_rp77_a_union_of_two_polyhedra():
    """x1 - x2 - x3 < 0 where x3 <= 5, x3 - x2 < 0 elsewhere."""
    centre = [10.0, 0.0, 4.0]
    parts = (
        half_spaces([[1.0, -1.0, -1.0], [0.0, 0.0, 1.0]], [0.0, 5.0], centre),
        half_spaces([[0.0, -1.0, 1.0], [0.0, 0.0, -1.0]], [0.0, -5.0], centre),
    )
    covariance = np.diag([0.25, 1.0, 1.0])[None]
    logs = [log_overlap(part, np.array([centre]), covariance)[0] for part in parts]
    weight = norm(4.0).pdf
    below = quad(lambda x: weight(x) * ndtr((x - 10) / np.sqrt(1.25)), -11, 5, epsabs=0)[0]
    above = quad(lambda x: weight(x) * ndtr(-x), 5, 19, epsabs=0)[0]
    assert np.exp(logs) == pytest.approx([below, above], rel=1e-9)
    assert np.exp(logs).sum() == pytest.approx(2.87e-7, rel=0.07)


def falling(deviations: float, steps: int) -> tuple[Game, tuple]:
    """Return an agent above a block that is there only at the time ``steps``.

    The sum of the noise of that many steps has to exceed ``deviations`` of its own.
    """
    body, clear = Polytope.box([1.0, 1.0]), deviations * np.sqrt(steps)
    path = [[0.0, -FAR - 100.0]] * steps + [[0.0, -clear - FAR - 0.5]]
    block = Obstacle(Polytope.box([400.0, 2 * FAR]), np.array(path), until=steps + 1)
    agent = Agent([0.0, 0.0], [10.0, 0.0], body, Polytope.box([20.0, 20.0]), gain=0.0, noise=1.0)
    game = Game((agent,), horizon=steps + 1, obstacles=(block,))
    controls = np.zeros((steps + 1, 2))
    controls[-1] = [10.0, 0.0]
    return game, (make_plan(agent, controls),)


def test_rp107_ten_normals_by_importance_sampling_and_exactly():
    game, plan = falling(5.0, 10)
    estimate, bounds = rare_risk(game, plan, 20_000).any, risk_bounds(game, plan).any
    assert estimate.low <= ndtr(-5.0) <= estimate.high * (1 + 1e-6)  # the block is finite
    assert bounds.least == pytest.approx(ndtr(-5.0), rel=1e-9)
    assert bounds.least == pytest.approx(2.92e-7, rel=0.02)


def test_r_minus_s_by_counting_and_exactly():
    """R - S with R of mean 4, S of mean 2, both of deviation 1: Phi(-sqrt 2) = 0.0786496."""
    game, plan = falling(np.sqrt(2.0), 2)
    counted = crash_counts(game, plan, 200_000, seed=1).estimates()[1]
    assert counted.low <= 0.0786496035251 <= counted.high
    assert risk_bounds(game, plan).any.least == pytest.approx(0.0786496035251, rel=1e-9)
