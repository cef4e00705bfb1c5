"""Scenarios in three dimensions."""

from __future__ import annotations

from ppg_env.scenarios.course import Course


def intersection_3d() -> Course:
    """Three agents, one along each axis of space, that would all meet in the middle."""
    return Course(
        [(10, 50, 50), (50, 10, 50), (50, 50, 10)], [(90, 50, 50), (50, 90, 50), (50, 50, 90)]
    )
