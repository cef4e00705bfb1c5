"""Corridors, doors and alcoves, for single integrators and for robots that park at their goals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from benchmarks.library.families.tables import (
    Draft,
    Table,
    game,
    robot,
    scenario_tables,
    walker,
    wall,
)

TRIPS = (((1, 2), (5, 2)), ((5, 3), (1, 3)), ((1, 1), (5, 1)), ((5, 0.8), (2.2, 2)))
"""Starts and goals in two rooms of 3 by 4 m."""


def games() -> Iterator[Draft]:
    """Yield rooms of several widths."""
    for width in (24, 34, 45, 60):
        for collisions in ("instants", "swept"):
            fields = {"speed": "l1", "objective": "risk", "collisions": collisions}
            yield f"corridor{width}-{collisions}", scenario_tables(f"corridor({width})", **fields)
    for gap in (0.8, 1.0, 1.6):
        for n in (2, 3):
            yield f"door{gap}-walkers{n}", _door(gap, TRIPS[:n], robots=False)
        yield f"door{gap}-robots2", _door(gap, TRIPS[:2], robots=True)
    yield "door1.0-walkers4", _door(1.0, TRIPS, robots=False)
    for depth in (1.0, 1.4):
        for middle in (2.0, 2.5):
            yield f"alcove{depth}-{middle}-walkers", _alcove(depth, middle, robots=False)
    yield "alcove1.0-2.5-robots", _alcove(1.0, 2.5, robots=True)


def _door(gap: float, trips: Sequence[tuple[Sequence[float], ...]], *, robots: bool) -> Table:
    walls = [wall(2.8, 0, 3.2, 2 - gap / 2), wall(2.8, 2 + gap / 2, 3.2, 4)]
    low, high = [0.3, 0.3], [5.7, 3.7]
    agents = [
        robot(start, goal, low, high)
        if robots
        else walker(start, goal, within={"low": low, "high": high})
        for start, goal in trips
    ]
    return game(14 if robots else 12, agents, walls, on_goal="stay")


def _alcove(depth: float, middle: float, *, robots: bool) -> Table:
    left, right, top = middle - 0.7, middle + 0.7, 1 + depth
    walls = [wall(0, 1, left, 2.4), wall(right, 1, 5, 2.4), wall(left, top, right, 2.6)]
    low, high, ends = [0.4, 0.4], [4.6, top - 0.4], ((0.5, 0.5), (4.5, 0.5))
    agents = [
        robot(start, goal, low, high, noise=0.0001)
        if robots
        else walker(start, goal, within={"low": low, "high": high}, noise=0.0001)
        for start, goal in (ends, ends[::-1])
    ]
    return game(12, agents, walls, on_goal="stay")
