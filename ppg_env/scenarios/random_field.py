"""Agents scattered at random."""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np

from ppg_env.errors import InputError, require
from ppg_env.scenarios.course import Course

ROOM = 45.0
"""Side of the square per agent: bodies of side 15 cover a ninth of the field."""

APART = 30.0
"""Least distance, along some axis, between two starts and between two goals."""

TRIES = 10_000


def random(n: int = 6, seed: int = 0) -> Course:
    """N agents with starts and goals scattered over a square that grows with n."""
    require(n >= 1, "n", f"is {n}", "ask for at least one agent")
    require(seed >= 0, "seed", f"is {seed}", "write a number that is not negative")
    generator, side = np.random.default_rng(seed), max(ROOM * sqrt(n), 100.0)
    starts, goals = (_scattered(generator, n, side) for _ in range(2))
    farthest = float(np.abs(goals - starts).sum(axis=1).max())
    return Course(starts.tolist(), goals.tolist(), horizon=max(15, ceil(farthest / 10) + 5))


def _scattered(generator: np.random.Generator, n: int, side: float) -> np.ndarray:
    """Return points (n, 2), no two within :data:`APART` of each other along both axes."""
    points: list[np.ndarray] = []
    for _ in range(TRIES):
        point = generator.uniform(0, side, 2).round(1)
        if all(np.abs(point - other).max() >= APART for other in points):
            points.append(point)
            if len(points) == n:
                return np.array(points)
    raise InputError("n", f"is {n}, which does not fit the field", "write a smaller number")
