"""Moving obstacles, unequal agents, noise from none to heavy, effort, reserve and workspaces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.library.families.tables import Draft, Table, game, walker

USUAL: dict[str, Any] = {"noise": 1.9, "shape": {"box": [15.0, 15.0]}, "control": {"l1": 10.0}}


def games() -> Iterator[Draft]:
    """Yield crossings of two or three agents with a field that varies."""
    for noise in (0.0, 0.01, 0.5, 4.0, 8.0):
        for gain in (0.0, 0.5):
            yield f"noise{noise}-gain{gain}", _crossing({"noise": noise, "gain": gain})
    for weights in ((0.1, 0.9), (0.9, 0.1), (0.2, 0.5), (0.7, 0.3)):
        name = f"unequal-lam-{weights[0]}-{weights[1]}"
        yield name, _crossing({"lam": weights[0]}, {"lam": weights[1]})
    small, slow = {"shape": {"disc": 5.0, "sides": 8}}, {"control": {"disc": 6.0, "sides": 16}}
    kite = {"shape": {"vertices": [[-8, 0], [0, -5], [12, 0], [0, 5]]}}
    yield "unequal-body-small", _crossing({}, small)
    yield "unequal-body-kite", _crossing(kite, small)
    yield "unequal-speed-slow", _crossing({}, slow)
    yield "unequal-noise", _crossing({"noise": 0.2}, {"noise": [[4.0, 1.5], [1.5, 2.0]]})
    yield "unequal-three", _crossing(kite, small, slow | {"lam": 0.3})
    yield "effort-0.05", _crossing({"effort": 0.05}, {"effort": 0.05})
    yield "effort-0.2-one", _crossing({"effort": 0.2}, {})
    yield "reserve-1", _crossing({"reserve": 1.0}, {"reserve": 1.0})
    yield "brake-2", _crossing({"control": [{"l1": 10.0}, {"from": 5, "l1": 8.0}]}, {})
    for seed in range(8):
        yield f"moving{1 + seed % 2}-{seed}", _moving(1 + seed % 2, seed)


def _crossing(*fields: dict[str, Any]) -> Table:
    trips = (((10, 50), (90, 50)), ((50, 10), (50, 90)), ((90, 85), (15, 20)))
    chosen = fields if len(fields) > 1 else fields * 2
    agents = [walker(*trip, **(USUAL | own)) for trip, own in zip(trips, chosen, strict=False)]
    return game(18, agents)


def _moving(count: int, seed: int) -> Table:
    generator = np.random.default_rng(seed)
    obstacles = []
    for _ in range(count):
        x = round(float(generator.uniform(30, 70)), 1)
        first = round(float(generator.uniform(-10, 25)), 1)
        speed = round(float(generator.uniform(4, 9)), 1)
        path = [[x, round(first + speed * t, 1)] for t in range(16)]
        obstacles.append({"box": [10.0, 20.0], "path": path, "noise": 0.5, "until": 15})
    agents = [walker((10, 50), (90, 50), **USUAL), walker((90, 58), (10, 42), **USUAL)]
    return game(18, agents[: 1 + (seed // 2) % 2], obstacles)
