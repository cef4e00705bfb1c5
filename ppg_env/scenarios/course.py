"""The course of a scenario: all of a game that has no default."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ppg_env.game.polytope import Polytope


@dataclass(frozen=True)
class Course:
    """Starts and goals of N agents in d dimensions, and the static obstacles between them.

    Attributes
    ----------
    starts, goals : N points of d coordinates each.
    obstacles : static polytopes.
    horizon : last step H.
    """

    starts: Sequence[Sequence[float]]
    goals: Sequence[Sequence[float]]
    obstacles: tuple[Polytope, ...] = ()
    horizon: int = 15
