"""Agents on a circle, each with the opposite point as its goal."""

from __future__ import annotations

from math import ceil, cos, pi, sin, sqrt

from ppg_env.errors import require
from ppg_env.scenarios.course import Course

SPACING = 30.0
"""Room along the chord between neighbours: the diagonal of a 15x15 body and 3 sqrt(2) sigma of
the paper's noise after one step."""


def circle(n: int = 6, radius: float | None = None) -> Course:
    """N agents evenly on a circle, each bound for the point opposite; all meet in the middle."""
    require(n >= 1, "n", f"is {n}", "ask for at least one agent")
    if radius is None:
        radius = max(40.0, SPACING / (2 * sin(pi / n))) if n > 1 else 40.0
    require(radius > 0, "radius", f"is {radius}", "write a positive number")
    angles = [2 * pi * k / n for k in range(n)]
    starts = [(radius * cos(a), radius * sin(a)) for a in angles]
    goals = [(-x, -y) for x, y in starts]
    # The slowest default speed set is the L1 ball of radius 10; three more steps to give way.
    slowest = ceil(2 * radius * sqrt(2) / 10)
    return Course(starts, goals, horizon=max(15, slowest + 3))
