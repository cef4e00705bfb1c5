"""Swarms in three dimensions: boxes with starts and goals on the faces of a cube."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.library.families.tables import Draft, Table, game, scenario_tables, walker

SIDE = 80.0


def games() -> Iterator[Draft]:
    """Yield the crossing of three axes, and swarms of 2 to 20 agents."""
    for objective in ("margin", "risk"):
        for collisions in ("instants", "swept"):
            fields = {"objective": objective, "collisions": collisions}
            yield f"axes3d-{objective}-{collisions}", scenario_tables("intersection_3d", **fields)
    for n, seeds in ((2, 3), (3, 3), (4, 2), (6, 1), (10, 1), (20, 1)):
        for seed in range(seeds):
            yield f"swarm{n}-{seed}", _swarm(n, seed)


def _swarm(n: int, seed: int) -> Table:
    generator = np.random.default_rng([n, seed])
    grid = generator.permutation([(25.0 * a, 25.0 * b) for a in range(5) for b in range(5)])
    ends = generator.permutation(grid)
    agents = [
        walker(
            [0.0, *map(float, grid[k])] if k % 2 else [SIDE, *map(float, grid[k])],
            [SIDE, *map(float, ends[k])] if k % 2 else [0.0, *map(float, ends[k])],
            noise=1.9,
            shape={"box": [15.0] * 3},
            control={"box": [10.0] * 3},
        )
        for k in range(n)
    ]
    return game(16, agents)
