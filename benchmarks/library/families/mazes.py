"""Mazes: a random spanning tree of a grid of rooms, with walls where the tree has no edge."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.library.families.tables import Draft, Table, game, walker, wall

ROOM = 2.0
HALF = 0.1
"""Half the thickness of a wall."""

Cell = tuple[int, int]


def games() -> Iterator[Draft]:
    """Yield mazes for one, two and three agents."""
    for size, agents, seeds in ((2, 1, 2), (3, 1, 5), (3, 2, 4), (2, 2, 2), (4, 1, 3), (3, 3, 1)):
        for seed in range(seeds):
            yield f"maze{size}-agents{agents}-{seed}", _maze(size, agents, seed)


def _maze(size: int, count: int, seed: int) -> Table:
    generator = np.random.default_rng([size, count, seed])
    doors = tree(size, generator)
    walls = []
    for x in range(size):
        for y in range(size):
            for cell in ((x + 1, y), (x, y + 1)):
                if max(cell) < size and frozenset(((x, y), cell)) not in doors:
                    walls.append(_between((x, y), cell))
    corners = [(0, 0), (size - 1, size - 1), (0, size - 1), (size - 1, 0)]
    trips = [(corners[k], corners[k ^ 1]) for k in range(count)]
    edge = ROOM * size - 0.3
    within = {"low": [0.3, 0.3], "high": [edge, edge]}
    agents = [walker(_centre(a), _centre(b), within=within, noise=0.0001) for a, b in trips]
    return game(2 * size * size + 4, agents, walls)


def tree(size: int, generator: np.random.Generator) -> set[frozenset[Cell]]:
    """Return the doors of a depth-first search from the first room."""
    doors: set[frozenset[Cell]] = set()
    stack: list[Cell] = [(0, 0)]
    visited = {(0, 0)}
    while stack:
        x, y = stack[-1]
        around = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
        free = [c for c in around if min(c) >= 0 and max(c) < size and c not in visited]
        if not free:
            stack.pop()
            continue
        chosen = free[int(generator.integers(len(free)))]
        doors.add(frozenset(((x, y), chosen)))
        visited.add(chosen)
        stack.append(chosen)
    return doors


def _centre(cell: Cell) -> list[float]:
    return [ROOM * (cell[0] + 0.5), ROOM * (cell[1] + 0.5)]


def _between(a: Cell, b: Cell) -> Table:
    if a[0] != b[0]:
        x, y = ROOM * b[0], ROOM * a[1]
        return wall(x - HALF, y - HALF, x + HALF, y + ROOM + HALF)
    x, y = ROOM * a[0], ROOM * b[1]
    return wall(x - HALF, y - HALF, x + ROOM + HALF, y + HALF)
