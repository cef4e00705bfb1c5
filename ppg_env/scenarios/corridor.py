"""Two-way traffic between two walls."""

from __future__ import annotations

from ppg_env.errors import require
from ppg_env.game.polytope import Polytope
from ppg_env.scenarios.course import Course

LENGTH = 40.0
"""Length of the corridor."""


def corridor(width: float = 45.0) -> Course:
    """Two agents meet in a corridor between static walls; if it is narrow, one has to wait."""
    require(width > 15, "width", f"is {width}", "write more than 15, the width of a body")
    low, high = (100 - LENGTH) / 2, (100 + LENGTH) / 2
    walls = [
        Polytope.from_vertices([(low, y), (high, y), (high, y + 30), (low, y + 30)])
        for y in (50 - width / 2 - 30, 50 + width / 2)
    ]
    return Course([(5, 50), (95, 50)], [(100, 50), (0, 50)], tuple(walls), horizon=20)
