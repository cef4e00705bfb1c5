"""Mazes of 9 x 9 cells for one agent, with thin walls and a horizon of 40 steps."""

from __future__ import annotations

from collections import deque
from itertools import product

import numpy as np

from benchmarks.library.families.mazes import Cell, tree
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.polytope import Polytope

SIZE, HORIZON = 9, 40
HALF = 0.1
"""Half the thickness of a wall; cells have a width of 1."""

LONGEST = 34
"""Cells that the way to the goal leads through at most, so that there is time enough."""


def nine_by_nine(seed: int) -> Game:
    """Return a maze drawn from a seed; the goal is the cell furthest away in time."""
    doors = tree(SIZE, np.random.default_rng([SIZE, seed]))
    far = _distances(doors)
    goal = max((cell for cell in far if far[cell] <= LONGEST), key=lambda cell: (far[cell], cell))
    body, control = Polytope.box([0.55, 0.55]), Polytope.l1(1.0)
    ends, still = (np.zeros(2), np.array(goal, dtype=float)), np.zeros((2, 2))
    agent = Agent(*ends, body, control, lam=0.8, gain=0.5 * np.eye(2), noise=still)
    low, high = -0.5, SIZE - 0.5
    sides = [(low, high), (low, low - 0.6), (high, high + 0.6)]
    walls = [_box(x, y) for x, y in ((sides[1], sides[0]), (sides[2], sides[0]))]
    walls += [_box(x, y) for x, y in ((sides[0], sides[1]), (sides[0], sides[2]))]
    for x, y in product(range(SIZE), repeat=2):
        for axis, other in enumerate(((x + 1, y), (x, y + 1))):
            if max(other) < SIZE and frozenset(((x, y), other)) not in doors:
                walls.append(_between((x, y), axis))
    obstacles = tuple(Obstacle(wall) for wall in walls)
    return Game((agent,), obstacles, HORIZON, objective="risk", collisions="swept")


def _distances(doors: set[frozenset[Cell]]) -> dict[Cell, int]:
    """Return the number of doors between the first cell and each cell."""
    result: dict[Cell, int] = {(0, 0): 0}
    queue = deque(result)
    while queue:
        cell = queue.popleft()
        for (other,) in (door - {cell} for door in doors if cell in door):
            if other not in result:
                result[other] = result[cell] + 1
                queue.append(other)
    return result


def _between(cell: Cell, axis: int) -> Polytope:
    """Return the wall between a cell and the next one along an axis."""
    spans = [(c - 0.5 - HALF, c + 0.5 + HALF) for c in cell]
    spans[axis] = (cell[axis] + 0.5 - HALF, cell[axis] + 0.5 + HALF)
    return _box(*spans)


def _box(x: tuple[float, float], y: tuple[float, float]) -> Polytope:
    return Polytope.from_vertices([list(corner) for corner in product(x, y)])
