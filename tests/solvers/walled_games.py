"""Small games among walls, drawn by kind and seed."""

from __future__ import annotations

from collections.abc import Callable
from zlib import crc32

import numpy as np

from ppg_env import Agent, Game, Obstacle, Polytope

Random = np.random.Generator

DOUBLE = np.eye(4) + np.eye(4, k=2)
"""Dynamics of a double integrator with positions and speeds."""


def walled_game(kind: str, seed: int) -> Game:
    """Return the game of a kind of :data:`KINDS`, drawn from a seed."""
    return KINDS[kind](np.random.default_rng([crc32(kind.encode()), seed]))


def box(left: float, low: float, right: float, high: float) -> Polytope:
    return Polytope.from_vertices([[left, low], [right, low], [right, high], [left, high]])


def room(left: float, low: float, right: float, high: float, thick: float = 0.6) -> list[Polytope]:
    return [
        box(left - thick, low - thick, left, high + thick),
        box(right, low - thick, right + thick, high + thick),
        box(left, low - thick, right, low),
        box(left, high, right, high + thick),
    ]


def body(start: object, goal: object, shape: Polytope, control: Polytope, **more: object) -> Agent:
    fields = {"lam": 0.8, "gain": 0.5, "noise": 0.0} | more
    return Agent(
        np.array(start, dtype=float), np.array(goal, dtype=float), shape, control, **fields
    )


def game(agents: list[Agent], obstacles: list[object], horizon: int, **more: object) -> Game:
    fields = {"objective": "risk", "collisions": "swept"} | more
    return Game(tuple(agents), tuple(obstacles), horizon, **fields)


def maze(random: Random) -> Game:
    """One agent in a maze of up to 9 x 9 cells, of walls as wide as cells."""
    n = int(random.choice([5, 7, 9]))
    free = np.zeros((n, n), dtype=bool)
    stack = [(0, 0)]
    free[0, 0] = True
    while stack:
        x, y = stack[-1]
        steps = [(dx, dy) for dx, dy in ((2, 0), (-2, 0), (0, 2), (0, -2))
                 if 0 <= x + dx < n and 0 <= y + dy < n and not free[x + dx, y + dy]]  # fmt: skip
        if not steps:
            stack.pop()
            continue
        dx, dy = steps[random.integers(len(steps))]
        free[x + dx // 2, y + dy // 2] = free[x + dx, y + dy] = True
        stack.append((x + dx, y + dy))
    walls = [box(x - 0.5, y - 0.5, x + 0.5, y + 0.5) for x, y in np.argwhere(~free)]
    size = float(random.choice([0.6, 0.9]))
    control = Polytope.l1(1.0) if random.random() < 0.5 else Polytope.disc(1.0, 8)
    agent = body([0, 0], [n - 1, n - 1], Polytope.box([size, size]), control)
    return game([agent], [*walls, *room(-0.5, -0.5, n - 0.5, n - 0.5)], 40)


def alcove(random: Random) -> Game:
    """Two agents exchange the ends of a corridor with an alcove."""
    length, low = float(random.uniform(4, 5)), 0.7
    left = float(random.uniform(1.2, 1.8))
    walls = [box(0, low, left, 1.5), box(left + 0.9, low, length, 1.5)]
    disc, control = Polytope.disc(0.3, 8), Polytope.disc(float(random.uniform(0.25, 0.4)), 8)
    ends = [0.35, 0.35], [length - 0.35, 0.35]
    agents = [body(a, b, disc, control) for a, b in (ends, ends[::-1])]
    return game(agents, [*walls, *room(0, 0, length, 1.5)], 30)


def door(random: Random) -> Game:
    """Two or three agents cross a wall with one door, from both sides."""
    count, gap = int(random.integers(2, 4)), float(random.uniform(1.05, 1.6))
    walls = [box(-0.3, gap / 2, 0.3, 4), box(-0.3, -4, 0.3, -gap / 2)]
    agents = []
    for i in range(count):
        side = 1 - 2 * (i % 2)
        heights = random.uniform(-2, 2) + 1.2 * i, random.uniform(-3, 3)
        start, goal = [-3.0 * side, np.clip(heights[0], -3.4, 3.4)], [3.0 * side, heights[1]]
        agents.append(body(start, goal, Polytope.box([1.0, 1.0]), Polytope.box([1.6, 1.6]),
                           noise=0.002))  # fmt: skip
    return game(agents, [*walls, *room(-4, -4, 4, 4)], 20)


def merge(random: Random) -> Game:
    """Two to four cars on two lanes of which one ends, with speeds or accelerations as controls."""
    count, accelerate = int(random.integers(2, 5)), bool(random.integers(2))
    agents = []
    for i in range(count):
        lane = 1.75 + 3.5 * (i % 2)
        start, goal = [float(-7 * (i // 2) - random.uniform(0, 2)), lane], [70.0, 5.25]
        noise = np.diag([0.02, 0.005])
        if accelerate:
            agents.append(Agent(
                np.array([*start, 4.0, 0.0]), np.array(goal), Polytope.box([4.5, 2.0]),
                Polytope.box([3.0, 2.0]), 0.6, 0.0, np.kron(np.diag([1.0, 0.0]), noise), DOUBLE,
                np.vstack([0.5 * np.eye(2), np.eye(2)])))  # fmt: skip
        else:
            control = Polytope.from_vertices([[0, -1.5], [6, -1.5], [6, 1.5], [0, 1.5]])
            agents.append(
                body(start, goal, Polytope.box([4.5, 2.0]), control, lam=0.6, noise=noise)
            )
    walls = [box(-30, -3, 120, 0), box(-30, 7, 120, 10)]
    end = float(random.uniform(40, 50))
    walls.append(Polytope.from_vertices([[end, 0], [end + 15, 3.5], [120, 3.5], [120, 0]]))
    return game(agents, walls, 20)


def bend(random: Random) -> Game:
    """Two agents pass each other in an L-shaped room."""
    wide = float(random.uniform(1.6, 2.2))
    agents = [
        body([5.5, wide / 2], [wide / 2, 4.5], Polytope.disc(0.35, 8), Polytope.l1(1.0)),
        body([wide / 2, 5.5], [5.5, wide / 2], Polytope.box([0.7, 0.7]), Polytope.l1(1.0)),
    ]
    return game(agents, [box(wide, wide, 6, 6), *room(0, 0, 6, 6)], 24)


def sweeper(random: Random) -> Game:
    """One or two agents cross a hall in which bars move back and forth."""
    times = np.arange(25)
    bars: list[object] = []
    for k in range(2):
        phase, period = random.uniform(0, 1), random.uniform(6, 10)
        shift = 2.5 * np.sin(2 * np.pi * (times / period + phase))
        path = np.stack([np.full(25, 2.0 + 2.5 * k), 3.0 + shift], axis=1)
        bars.append(Obstacle(Polytope.box([0.5, 3.0]), path))
    small, control = Polytope.box([0.6, 0.6]), Polytope.l1(1.2)
    ends = [([0.5, 1.5], [6.5, 4.5]), ([0.5, 3.5], [6.5, 2.5])][: int(random.integers(1, 3))]
    agents = [body(*pair, small, control, noise=0.0005) for pair in ends]
    return game(agents, [*bars, *room(0, 0, 7, 6)], 24)


def unequal(random: Random) -> Game:
    """A large slow body and a small fast one pass a gap that the large one nearly fills."""
    gap = 2.05
    walls = [box(2.5, 1 + gap / 2, 3.5, 4), box(2.5, -2, 3.5, 1 - gap / 2)]
    large = body([1.0, float(random.uniform(0, 2))], [5, 1], Polytope.disc(1.0, 8),
                 Polytope.box([0.8, 0.8]))  # fmt: skip
    small = body([5.5, float(random.uniform(2.6, 3.6))], [0.5, float(random.uniform(-1.5, 3.5))],
                 Polytope.box([0.5, 0.5]), Polytope.box([2.0, 2.0]))  # fmt: skip
    return game([large, small], [*walls, *room(-0.5, -2, 6.5, 4)], 20)


def pillars(random: Random) -> Game:
    """Two to four agents cross among pillars."""
    count = int(random.integers(2, 5))
    posts = [box(x - 0.4, y - 0.4, x + 0.4, y + 0.4) for x in (-1.5, 1.5) for y in (-1.5, 1.5)]
    agents = []
    for i in range(count):
        angle = 2 * np.pi * (i + random.uniform(-0.2, 0.2)) / count
        start = 4.0 * np.array([np.cos(angle), np.sin(angle)])
        agents.append(
            body(start, -start, Polytope.disc(0.45, 6), Polytope.disc(1.0, 8), noise=0.003)
        )
    return game(agents, posts, 18)


def parked(random: Random) -> Game:
    """Two or three double integrators that stay at their goals change places in a hall."""
    count = int(random.integers(2, 4))
    places = np.array([[0.5, 0.5], [5.5, 0.5], [0.5, 3.5], [5.5, 3.5]]) + random.uniform(0, 0.4, 2)
    order = random.permutation(4)[:count]
    goals = np.roll(order, 1)
    agents = [
        Agent(np.array([*places[a], 0, 0]), np.array([*places[b], 0, 0]), Polytope.box([0.7, 0.7]),
              Polytope.box([0.5, 0.5]), 0.8, 0.0, 0.0, DOUBLE,
              np.vstack([0.5 * np.eye(2), np.eye(2)]))
        for a, b in zip(order, goals, strict=True)
    ]  # fmt: skip
    middle = box(2.2, 1.6, 3.8, 2.6)
    return game(agents, [middle, *room(0, 0, 6.4, 4.4)], 20, on_goal="stay")


KINDS: dict[str, Callable[[Random], Game]] = {
    kind.__name__: kind
    for kind in (maze, alcove, door, merge, bend, sweeper, unequal, pillars, parked)
}
