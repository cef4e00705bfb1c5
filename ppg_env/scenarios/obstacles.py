"""One agent among static obstacles, as in the paper's figure of its first program, MP1."""

from __future__ import annotations

from ppg_env.game.polytope import Polytope
from ppg_env.scenarios.course import Course


def course() -> Course:
    """One agent crosses a field of static obstacles, a side to choose at each."""
    obstacles = (
        Polytope.from_vertices([(30, 30), (44, 26), (46, 52), (32, 56)]),
        Polytope.from_vertices([(64, 48), (78, 44), (84, 60), (76, 74), (62, 72)]),
    )
    return Course([(10, 30)], [(95, 50)], obstacles)
