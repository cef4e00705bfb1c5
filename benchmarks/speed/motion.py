"""Plans that hold between steps: times with ``collisions="swept"``, and ratios to instants."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

from benchmarks.speed.engine import PAIRS
from benchmarks.speed.environment import on_one_core
from benchmarks.speed.measurement import Measurement
from ppg_env import tolerances as tol
from ppg_env.game import objective
from ppg_env.game.least_effort import straight_plan
from ppg_env.scenarios.make import make_game
from solvers.budget import Budget
from solvers.dispatch import ENGINE, minimise
from solvers.equilibrium.best_response_dynamics import best_response_dynamics
from solvers.optimum.joint import social_optimum
from solvers.solution import Status

WAREHOUSE = Path(__file__).with_name("warehouse.toml")
LIMIT = 300.0
"""Time limit of one equilibrium in seconds."""


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Measure best responses, a social optimum, and equilibria of bodies that stay."""
    with on_one_core():
        yield from _best_responses(quick)
        yield from _social(quick)
        yield _equilibrium("circle(4)" if quick else "circle(10)", 10, seed)
        if not quick:
            yield _equilibrium(str(WAREHOUSE), 120, seed)


def _best_responses(quick: bool) -> Iterator[Measurement]:
    spent: dict[str, list[float]] = {"swept": [], "instants": []}
    cases = product(PAIRS[:1] if quick else PAIRS, ("box", "l1"), ("margin", "risk"), (0.0, 0.5))
    for name, speed, kind, gain in cases:
        for collisions, times in spent.items():
            game = make_game(name, speed=speed, objective=kind, gain=gain, collisions=collisions)
            plans = [straight_plan(agent, game.horizon) for agent in game.agents]
            straight = tuple(plan for plan in plans if plan is not None)
            for _ in range(2):  # the first one imports and fills caches
                started = perf_counter()
                minimise(objective.selfish(game, 0), (0,), straight, ENGINE, Budget(None))
            times.append(perf_counter() - started)
    label = "best response, two agents, swept: "
    ratio = float(np.median(np.array(spent["swept"]) / spent["instants"]))
    yield Measurement(label + "median ms", 1e3 * median(spent["swept"]), 25)
    yield Measurement(label + "longest, ms", 1e3 * max(spent["swept"]), 0, True)
    yield Measurement(label + "times as long as at instants, median", ratio, 0, True)


def _social(quick: bool) -> Iterator[Measurement]:
    name = "intersection" if quick else "intersection3"
    seconds = {}
    for collisions in ("instants", "swept"):
        game = make_game(name, collisions=collisions)
        social_optimum(game)  # imports and fills caches
        seconds[collisions] = min(social_optimum(game).seconds for _ in range(3))
    yield Measurement(f"social optimum of {name}, swept: s", seconds["swept"], 0, True)
    ratio = seconds["swept"] / seconds["instants"]
    yield Measurement(f"social optimum of {name}: times as long as at instants", ratio, 3)


def _equilibrium(name: str, wanted: float, seed: int) -> Measurement:
    game = make_game(name, collisions="swept", on_goal="stay")
    solution = best_response_dynamics(game, seed=seed, time_limit=LIMIT)
    regret = np.inf if solution.regret is None else solution.regret.max()
    certified = solution.status is Status.EQUILIBRIUM and regret <= tol.EQUILIBRIUM
    label = f"equilibrium of {game.name}, swept, stay" + " (not certified)" * (not certified)
    return Measurement(f"{label}: s", solution.seconds, wanted)
