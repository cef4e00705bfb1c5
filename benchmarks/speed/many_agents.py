"""Many agents: certified equilibria, social optima with gaps, and replanning decisions."""

from __future__ import annotations

from collections.abc import Iterator
from time import process_time

import numpy as np

from benchmarks.speed.environment import on_one_core
from benchmarks.speed.measurement import Measurement
from ppg_env import tolerances as tol
from ppg_env.env import episodes as arena
from ppg_env.scenarios.make import make_game
from solvers.equilibrium.best_response_dynamics import best_response_dynamics
from solvers.feedback.replanning.replanner import replanning
from solvers.optimum.joint import social_optimum
from solvers.solution import Status

EQUILIBRIA = (("circle(10)", 5), ("circle(20)", 60), ("random(50, 0)", 600), ("streams(50)", 600))
OPTIMA = (("circle(10)", 5), ("circle(20)", 10))
LIMIT = 300.0
"""Time limit of one social optimum in seconds."""


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Measure Nash equilibria, then players that plan again, then social optima."""
    with on_one_core():
        for name, wanted in (("circle(6)", 5),) if quick else EQUILIBRIA:
            solution = best_response_dynamics(make_game(name))
            regret = np.inf if solution.regret is None else solution.regret.max()
            certified = solution.status is Status.EQUILIBRIUM and regret <= tol.EQUILIBRIUM
            label = f"equilibrium of {name}" + " (not certified)" * (not certified)
            yield Measurement(f"{label}: s", solution.seconds, wanted)
        for name in ("head_on", "intersection3"):
            yield from _decisions(name, 20 if quick else 200, seed)
        if not quick:
            yield from _proved()
        for name, wanted in (("circle(6)", 0),) if quick else OPTIMA:
            limit = 5.0 if quick else LIMIT
            solution = social_optimum(make_game(name), time_limit=limit, seed=seed)
            label = f"social optimum of {name}, {limit:g} s: gap in %"
            yield Measurement(label, 100 * solution.gap, wanted, at_least=not wanted)


def _proved() -> Iterator[Measurement]:
    solution = social_optimum(make_game("circle(5)"), time_limit=LIMIT)
    label = "social optimum of circle(5)" + " (open)" * (solution.status is not Status.OPTIMAL)
    yield Measurement(f"{label}: s", solution.seconds, LIMIT)
    yield Measurement("social optimum of circle(5): gap in %", 100 * solution.gap, 0, True)


def _decisions(scenario: str, episodes: int, seed: int) -> Iterator[Measurement]:
    """Measure players that plan again for all agents at every step."""
    game = make_game(scenario, speed="l1", objective="risk", lam=0.8)
    profile = social_optimum(game).profile
    assert profile is not None
    for name, social in (("receding-social", True), ("receding-nash", False)):
        players = replanning(game, profile, social=social)
        arena.evaluate(game, players, episodes=2, seed=seed)  # compiles
        started = process_time()
        played = arena.evaluate(game, players, episodes=episodes, seed=seed)
        decisions = played.arrival.sum()
        rate = decisions / (process_time() - started)
        label = f"decisions of {name} in {scenario}: per s"
        yield Measurement(label, rate, 200.0 if len(game.agents) == 2 else 30.0, True)
