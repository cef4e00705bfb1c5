"""Probabilities that others have published, for circles and squares under normal errors.

    Orekit 13.1, tests of short-term encounters in two dimensions: cases of Chan, of CSM and CDM
    messages, and of Alfano (Laas2015Test with the bounds of Serra et al., a method with proof;
    Alfano2005Test for the last case)
    NASA CARA Analysis Tools, PcCircle_UnitTest.m and Pc2D_Foster_UnitTest.m (the cases of Omitron)
    Alfano, Satellite conjunction Monte Carlo analysis (2009): states and covariances of
    eleven cases at the closest approach and, in PcCircle_UnitTest.m to 1e-3, their probabilities
    where the relative motion is straight; the twelfth has no relative velocity

CARA's quadrature of 64 points is inexact for the long ellipse of its last case, compared to
3e-4.  A circle is approximated by regular polygons of n corners, I within and C without;
(I + 2 C) / 3 has an error of order n^-4.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppg_env.risk.polytope_probability import log_polygon

SIDES = 1024

DATA = json.loads((Path(__file__).parents[2] / "oracles/published_encounters.json").read_text())


def whitened(corners: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    return np.linalg.solve(np.linalg.cholesky(covariance), corners.T).T


def polygon(corners: np.ndarray, covariance: np.ndarray) -> float:
    """Return the probability that a normal point with this covariance is inside."""
    return float(np.exp(log_polygon(whitened(corners, covariance)[None])[0]))


def circle(centre: np.ndarray, radius: float, covariance: np.ndarray) -> tuple[float, float, float]:
    """Return the probability of a circle: from within, from without, extrapolated."""
    angles = 2 * np.pi * (np.arange(SIDES) + 0.5) / SIDES
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    inner = polygon(centre + ring, covariance)
    outer = polygon(centre + ring / np.cos(np.pi / SIDES), covariance)
    return inner, outer, (inner + 2 * outer) / 3


@pytest.mark.parametrize("row", DATA["orekit"], ids=lambda row: f"{row['probability']:g}")
def test_encounters_of_orekit(row):
    value, covariance = row["probability"], np.diag([row["sigma_x"] ** 2, row["sigma_y"] ** 2])
    inner, outer, exact = circle(np.array([row["x"], row["y"]]), row["radius"], covariance)
    assert inner <= exact <= outer <= inner * (1 + 1e-3)
    last = 10 ** (np.floor(np.log10(value)) - (4 if f"{value:.4e}"[5] != "0" else 3))
    assert exact == pytest.approx(value, abs=1.01 * last)
    if "low" in row:
        assert row["low"] - row["digit"] <= exact <= row["high"] + row["digit"]


# --- NASA CARA ------------------------------------------------------------------------------------


def encounter_plane(case: dict[str, Any]) -> tuple[float, np.ndarray]:
    """Return the miss distance and the covariance in the plane across the relative velocity.

    The first axis is that of the miss, which CARA takes as the whole distance.
    """
    r = np.subtract(case["r1"], case["r2"])
    v = np.subtract(case["v1"], case["v2"])
    along, out = v / np.linalg.norm(v), np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    axes = np.stack([np.cross(along, out), out])
    covariance = axes @ np.add(case["cov1"], case["cov2"]) @ axes.T
    return float(np.linalg.norm(r)), (covariance + covariance.T) / 2


@pytest.mark.parametrize(
    ("case", "radius", "value", "accuracy"),
    [
        ("omitron_1", 0.020, 2.706023476569786e-05, 1e-9),
        ("omitron_2", 0.020, 1.807363058494765e-01, 1e-9),
        ("long", 1e2, 1.232312816404174e-05, 1e-9),
        ("long", 1e3, 6.343318773183237e-03, 3e-4),
        ("long", 3e3, 1.917884657463699e-02, 3e-4),
        ("long", 1e4, 6.389821634646267e-02, 3e-4),
        ("long", 3e4, 1.900663422510684e-01, 3e-4),
        ("long", 1e1, 2.514939701718358e-15, 1e-9),
    ],
)
def test_circles_of_nasa_cara(case, radius, value, accuracy):
    miss, covariance = encounter_plane(DATA["cara"][case])
    inner, outer, exact = circle(np.array([miss, 0.0]), radius, covariance)
    assert inner <= exact <= outer
    assert exact == pytest.approx(value, rel=accuracy)


def test_the_square_of_nasa_cara():
    miss, covariance = encounter_plane(DATA["cara"]["omitron_1"])
    square = 0.020 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) + [miss, 0.0]
    assert polygon(square, covariance) == pytest.approx(3.44534649703584e-05, rel=1e-10)


@pytest.mark.parametrize("row", DATA["alfano"], ids=lambda row: f"case {row['case']}")
def test_cases_of_alfano(row):
    miss, covariance = encounter_plane(row)
    inner, outer, exact = circle(np.array([miss, 0.0]), row["radius"], covariance)
    assert inner <= exact <= outer
    assert exact == pytest.approx(row["probability"], rel=1e-3)
