"""Two bodies that must not overlap."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ppg_env.errors import placed
from ppg_env.game.agent import Agent
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.polytope import Polytope, collision_set


@dataclass(frozen=True, slots=True)
class Encounter:
    """Two bodies that must not overlap.

    Attributes
    ----------
    agents : (i, j) with i < j, or (i,) with an obstacle.
    obstacle : index of the obstacle, None for a pair of agents.
    collision : K, the displacements at which they overlap; equal bodies share one object.
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


def all_encounters(agents: Sequence[Agent], obstacles: Sequence[Obstacle]) -> Iterator[Encounter]:
    """Yield each unordered pair of agents, then each agent with each obstacle.

    A collision set is computed once for all encounters of equal shapes.

    Raises
    ------
    InputError
        If two bodies have no volume together.
    """
    bodies = [*(agent.shape for agent in agents), *(obstacle.shape for obstacle in obstacles)]
    first: dict[Polytope, int] = {}
    kinds = [first.setdefault(shape, b) for b, shape in enumerate(bodies)]
    sets: dict[tuple[int, int], Polytope] = {}

    def collision(i: int, b: int, place: str) -> Polytope:
        key = kinds[i], kinds[b]
        if key not in sets:
            with placed(place):
                sets[key] = collision_set(bodies[i], bodies[b])
        return sets[key]

    N = len(agents)
    for i in range(N):
        for j in range(i + 1, N):
            yield Encounter((i, j), None, collision(i, j, f"agent[{j}].shape"))
    for i in range(N):
        for k in range(len(obstacles)):
            yield Encounter((i,), k, collision(i, N + k, f"obstacle[{k}]"))
