"""Two bodies that must not overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env.game.polytope import Polytope


@dataclass(frozen=True)
class Encounter:
    """Two bodies that must not overlap.

    Attributes
    ----------
    agents : (i, j) with i < j, or (i,) with an obstacle.
    obstacle : index of the obstacle, None for a pair of agents.
    collision : K, the displacements at which they overlap.
    """

    agents: tuple[int, ...]
    obstacle: int | None
    collision: Polytope

    def displacement(self, *positions: np.ndarray) -> np.ndarray:
        """Return r_i - r_j of a pair's positions (..., d), or r_i where j is an obstacle at 0."""
        return positions[0] - positions[1] if len(positions) == 2 else positions[0]

    @property
    def places(self) -> tuple[str, str]:
        """The two parties as error messages name them."""
        first = f"agent[{self.agents[0]}]"
        if self.obstacle is None:
            return first, f"agent[{self.agents[1]}]"
        return first, f"obstacle[{self.obstacle}]"
