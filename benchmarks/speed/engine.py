"""Times of the engine, and ratios to MILP solvers on the paper's formulation, in one run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from statistics import median
from time import perf_counter

import numpy as np

from benchmarks.speed.environment import on_one_core
from benchmarks.speed.measurement import Measurement
from ppg_env.game import objective
from ppg_env.game.game import Game
from ppg_env.game.least_effort import straight_plan
from ppg_env.scenarios.make import make_game
from solvers.budget import Budget
from solvers.dispatch import ENGINE, minimise
from solvers.search_result import SearchResult
from solvers.solution import Status

PAIRS = ("opposing", "head_on", "parallel", "intersection")
RIVALS = {"HIGHS": 50.0, "GUROBI": 4.0}
"""Target ratio of times to the engine, for three agents."""

CROWD = "circle(4, radius=40)"

PATIENCE = 300.0
"""Time limit of a rival in seconds; its ratio is then a lower bound."""


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Measure best responses of two agents, then social optima of three and of four."""
    with on_one_core():
        yield from _best_responses(quick)
        for lam in (0.5, 0.8):
            name = "intersection" if quick else "intersection3"
            game = make_game(name, gain=-0.5, horizon=14, margin_cap=6.0, lam=lam)
            yield from _joint(game, f"{name}, growing noise, lam {lam:g}", RIVALS)
        for gain in () if quick else (0.0, -0.5):
            game = make_game(CROWD, gain=gain, horizon=12, margin_cap=6.0, lam=0.8)
            yield from _joint(game, f"{CROWD}, gain {gain:g}", {"GUROBI": 3})


def _best_responses(quick: bool) -> Iterator[Measurement]:
    spent: dict[str, list[float]] = {ENGINE: [], "HIGHS": []}
    cases = product(PAIRS[:1] if quick else PAIRS, ("box", "l1"), ("margin", "risk"), (0.0, 0.5))
    for name, speed, kind, gain in cases:
        game = make_game(name, speed=speed, objective=kind, gain=gain)
        plans = [straight_plan(agent, game.horizon) for agent in game.agents]
        straight = tuple(plan for plan in plans if plan is not None)
        for solver, times in spent.items():
            for _ in range(2):  # the first one compiles
                started = perf_counter()
                minimise(objective.selfish(game, 0), (0,), straight, solver, Budget(None))
            times.append(perf_counter() - started)
    ratios = np.array(spent["HIGHS"]) / np.array(spent[ENGINE])
    milliseconds = 1e3 * median(spent[ENGINE])
    yield Measurement("best response, two agents: median ms", milliseconds, 20)
    yield Measurement("best response: longest, ms", 1e3 * max(spent[ENGINE]), 0, True)
    yield Measurement("best response: HiGHS / engine, median", float(np.median(ratios)), 0, True)


def _joint(game: Game, label: str, rivals: Mapping[str, float]) -> Iterator[Measurement]:
    reference, seconds = _social(game, ENGINE)
    proven = reference.status is Status.OPTIMAL
    yield Measurement(
        f"social optimum ({label}): engine, s" + " (open)" * (not proven), seconds, 0, True
    )
    for solver, wanted in rivals.items():
        if not _installed(solver):
            continue
        rival, longer = _social(game, solver)
        cut = " (cut short: at least)" if rival.status is not Status.OPTIMAL else ""
        yield Measurement(f"{label}: {solver} / engine{cut}", longer / seconds, wanted, True)


def _social(game: Game, solver: str) -> tuple[SearchResult, float]:
    agents, weights = range(len(game.agents)), objective.social(game)
    started = perf_counter()
    result = minimise(weights, agents, None, solver, Budget(PATIENCE))
    return result, perf_counter() - started


def _installed(solver: str) -> bool:
    from cvxpy.reductions.solvers.defines import INSTALLED_MI_SOLVERS

    return solver in INSTALLED_MI_SOLVERS
