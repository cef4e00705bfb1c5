"""Many agents: certified equilibria, social optima with gaps, and replanning decisions."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import median
from time import perf_counter

import numpy as np

from benchmarks.speed.environment import on_one_core
from benchmarks.speed.measurement import Measurement
from ppg_env import tolerances as tol
from ppg_env.env import episodes as arena
from ppg_env.env.players import View
from ppg_env.scenarios.make import make_game
from solvers.equilibrium.best_response_dynamics import best_response_dynamics
from solvers.feedback.receding_horizon import RecedingHorizon
from solvers.optimum.joint import social_optimum
from solvers.solution import Status

EQUILIBRIA = (("circle(10)", 5), ("circle(20)", 60), ("random(50, 0)", 600), ("streams(50)", 600))
OPTIMA = (("circle(10)", 5), ("circle(20)", 10))
LIMIT = 300.0
"""Time limit of one social optimum in seconds."""


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Measure Nash equilibria, then decisions of a receding horizon, then social optima."""
    with on_one_core():
        for name, wanted in (("circle(6)", 5),) if quick else EQUILIBRIA:
            solution = best_response_dynamics(make_game(name))
            regret = np.inf if solution.regret is None else solution.regret.max()
            certified = solution.status is Status.EQUILIBRIUM and regret <= tol.EQUILIBRIUM
            label = f"equilibrium of {name}" + " (not certified)" * (not certified)
            yield Measurement(f"{label}: s", solution.seconds, wanted)
        yield _decisions(20 if quick else 200, seed)
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


class _Timed(RecedingHorizon):
    """Records the seconds of each call that made new plans."""

    spent: list[float]

    def act(self, view: View) -> np.ndarray:
        started, due = perf_counter(), self._due(view)
        action = super().act(view)
        if due:
            self.spent.append((perf_counter() - started) / due)
        return action

    def _due(self, view: View) -> int:
        own = view.clock[view.in_traffic[:, self._agent]]
        return int(((own > 0) & (own % self._every == 0)).sum())


def _decisions(episodes: int, seed: int) -> Measurement:
    spent: list[float] = []
    for name, speed in (("head_on", "box"), ("intersection", "l1")):
        game = make_game(name, speed=speed)
        profile = best_response_dynamics(game).profile
        assert profile is not None
        players = [_Timed(game, i, profile) for i in range(len(game.agents))]
        for player in players:
            player.spent = spent
        arena.evaluate(game, players, episodes=episodes, seed=seed)
    return Measurement("receding horizon, two agents: median ms", 1e3 * median(spent), 30)
