"""Warehouses: robots between rows of shelves, parked at their goals; and slaloms of one agent."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.library.families.tables import Draft, Table, game, robot, walker, wall

AISLES = (0.7, 2.7, 4.7)
COLUMNS = (0.8, 3.4, 6.0)


def games() -> Iterator[Draft]:
    """Yield warehouses of one to six agents, and slaloms."""
    for n in (1, 2, 3, 4, 6):
        yield f"warehouse-walkers{n}", _warehouse(n, robots=False)
    for n in (1, 2, 3):
        yield f"warehouse-robots{n}", _warehouse(n, robots=True)
    for posts in (1, 2, 3):
        for seed in range(3):
            yield f"slalom{posts}-{seed}", _slalom(posts, seed)


def _warehouse(n: int, *, robots: bool) -> Table:
    shelves = [wall(x, y, x + 1.6, y + 1.0) for x in (1.3, 3.9) for y in (1.2, 3.2)]
    places = [(x, y) for x in (COLUMNS[0], COLUMNS[2]) for y in AISLES]
    low, high = [0.3, 0.3], [6.5, 5.1]
    agents = []
    for k in range(n):
        start, goal = places[k], places[-1 - k]
        if robots:
            agents.append(robot(start, goal, low, high, noise=0.0001))
        else:
            within = {"low": low, "high": high}
            agents.append(walker(start, goal, within=within, noise=0.0001))
    return game(16 if robots else 14, agents, shelves, on_goal="stay")


def _slalom(posts: int, seed: int) -> Table:
    generator = np.random.default_rng([posts, seed])
    obstacles = []
    for k in range(posts):
        y = round(float(generator.uniform(1.2, 2.8)), 2)
        obstacles.append(wall(2 + 2.5 * k, y - 0.9, 2.6 + 2.5 * k, y + 0.9))
    end = 2.5 * posts + 2.5
    within = {"low": [0, 0], "high": [end + 0.5, 4]}
    agent = walker([0.5, 2.0], [end, 2.0], within=within, noise=0.004)
    return game(12 + 3 * posts, [agent], obstacles)
