"""Times of the main operations in seconds, with their targets.

Set-up (creating the game, the first import) is outside the timed region unless it is the subject.
Absolute times depend on the machine; compare ratios between runs of one session.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from time import perf_counter

from benchmarks.speed.measurement import Measurement
from ppg_env.game.game import Game
from ppg_env.game.least_effort import straight_plan
from ppg_env.game.plan import Profile
from ppg_env.risk.monte_carlo import crash_counts
from ppg_env.scenarios.make import make_game

PAPER = ("opposing", "head_on", "parallel", "intersection", "intersection3")
GAINS = (0.0, 0.5)


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Run every measurement; ``quick`` takes one scenario and few episodes."""
    for speed in ("box",) if quick else ("box", "l1"):
        for objective in ("margin", "risk"):
            for name in PAPER[:1] if quick else PAPER:
                for gain in GAINS[-1:] if quick else GAINS:
                    game = make_game(name, speed=speed, objective=objective, gain=gain)
                    yield from _planning(game, f"{name}, {speed}, {objective}, gain {gain:g}")
    yield _simulation(20_000 if quick else 1_000_000, seed)
    yield Measurement("import ppg_env", _python("import ppg_env"), 0.5)
    yield Measurement(
        "ppg --help", _python("from benchmarks.cli import main; main(['--help'])"), 0.6
    )


def _planning(game: Game, label: str) -> Iterator[Measurement]:
    from solvers.equilibrium.best_response import best_response
    from solvers.optimum.joint import social_optimum

    profile = _straight(game)
    yield Measurement(
        f"best response, first ({label})", _seconds(lambda: best_response(game, 0, profile)), 0.5
    )
    yield Measurement(
        f"best response, again ({label})", _seconds(lambda: best_response(game, 0, profile)), 0.1
    )
    if len(game.agents) == 2:
        yield Measurement(f"social optimum ({label})", _seconds(lambda: social_optimum(game)), 2.0)


def _simulation(episodes: int, seed: int) -> Measurement:
    game = make_game("parallel", goal={0: [160.0, 70.0], 1: [160.0, 35.0]})
    profile = _straight(game)  # 150 units at top speed 10: in traffic for all 15 steps
    seconds = _seconds(lambda: crash_counts(game, profile, episodes, seed))
    return Measurement(f"{episodes:,} episodes, 2 agents, 15 steps", seconds, 10.0)


def _straight(game: Game) -> Profile:
    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    return tuple(plan for plan in plans if plan is not None)


def _seconds(work: Callable[[], object]) -> float:
    started = perf_counter()
    work()
    return perf_counter() - started


def _python(code: str) -> float:
    """Return the least seconds of three runs of ``code`` in a fresh interpreter."""
    command = [sys.executable, "-c", code]
    return min(
        _seconds(lambda: subprocess.run(command, check=True, capture_output=True)) for _ in range(3)
    )
