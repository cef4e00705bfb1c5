"""Merging lanes, overtaking and roundabouts: double integrators on roads."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, pi, sin

from benchmarks.library.families.tables import Draft, Table, game, robot, walker, wall

LOW, HIGH = [-40, 1, 0, -1.5], [100, 6, 12, 1.5]


def games() -> Iterator[Draft]:
    """Yield roads with two to five vehicles."""
    for gap in (-8, -4, 0):
        yield f"merge2-gap{gap}", _merge(gap, truck=False, third=False)
        yield f"merge2-gap{gap}-truck", _merge(gap, truck=True, third=False)
    yield "merge3", _merge(-8, truck=False, third=True)
    for lead in (16, 24):
        for slow in (4, 6):
            yield f"overtaking-{lead}-{slow}", _overtaking(lead, slow, oncoming=False)
    yield "overtaking-24-4-oncoming", _overtaking(24, 4, oncoming=True)
    for n in (2, 3, 4, 5):
        yield f"roundabout{n}-walkers", _roundabout(n, robots=False)
    for n in (2, 3, 4):
        yield f"roundabout{n}-robots", _roundabout(n, robots=True)


def _car(x: float, y: float, speed: float, goal: tuple[float, float], **fields: object) -> Table:
    table = robot([x, y], [*goal], [0, 0], [0, 0], noise=0.01)
    table |= {"start": [x, y, speed, 0], "goal": [*goal], "shape": {"box": [4.5, 2]}}
    return table | {"control": {"box": [2, 1]}, "within": {"low": LOW, "high": HIGH}} | fields


def _merge(gap: float, *, truck: bool, third: bool) -> Table:
    end = {"vertices": [[30, 0], [90, 0], [90, 3.5], [42, 3.5]]}
    cars = [_car(0, 1.75, 8, (60, 5.25)), _car(gap, 5.25, 8, (56 + gap, 5.25))]
    if third:
        cars.append(_car(-16, 1.75, 8, (44, 5.25)))
    ahead = {"box": [8, 2.5], "path": [[12 + 7 * t, 5.25] for t in range(12)]}
    ahead |= {"noise": [[0.01, 0], [0, 0.0025]]}
    return game(12, cars, [end, ahead] if truck else [end])


def _overtaking(lead: float, slow: float, *, oncoming: bool) -> Table:
    cars = [_car(0, 1.75, 8, (64, 1.75)), _car(lead, 1.75, slow, (lead + 8 * slow, 1.75))]
    cars[1]["within"] = {"low": [-40, 1, 0, -1.5], "high": [100, 6, slow, 1.5]}
    other = {"box": [5, 2], "path": [[75 - 6 * t, 5.25] for t in range(12)]}
    return game(12, cars, [other] if oncoming else [])


def _roundabout(n: int, *, robots: bool) -> Table:
    ends = [(3.5 * cos(2 * pi * k / n), 3.5 * sin(2 * pi * k / n)) for k in range(n)]
    rounded = [[round(x, 3), round(y, 3)] for x, y in ends]
    low, high = [-4, -4], [4, 4]
    agents = [
        robot([x, y], [-x, -y], low, high)
        if robots
        else walker([x, y], [-x, -y], within={"low": low, "high": high})
        for x, y in rounded
    ]
    island = {"disc": 1.0, "sides": 8} if n % 2 == 0 else wall(-0.8, -0.8, 0.8, 0.8)
    return game(16 if robots else 14, agents, [island])
