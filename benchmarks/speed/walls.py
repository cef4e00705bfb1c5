"""First plans and proofs among walls: the library's games and mazes, in CPU seconds."""

from __future__ import annotations

from collections.abc import Iterator
from time import process_time

from benchmarks.library.instance import instances
from benchmarks.speed.environment import on_one_core
from benchmarks.speed.mazes import nine_by_nine
from benchmarks.speed.measurement import Measurement
from ppg_env.game.game import Game
from solvers.optimum.joint import social_optimum
from solvers.solution import Status

GAMES = (
    *(
        f"maze{size}-agents1-{seed}"
        for size, seeds in ((2, 2), (3, 5), (4, 3))
        for seed in range(seeds)
    ),
    "merge3",
    "alcove1.0-2.0-walkers",
)
"""All mazes for one agent, three cars that merge, and two agents and an alcove."""

MAZES = 3
"""Mazes of 9 x 9 cells."""

FIRST, PROOF = 5.0, 60.0
"""Targets in seconds; the second one is the time limit, too."""


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Measure social optima: the time to the first plans, and to the proof."""
    games = {instance.path.parent.name: instance for instance in instances()}
    with on_one_core():
        for name in GAMES[:1] if quick else GAMES:
            yield from _measured(name, games[name].game)
        for number in () if quick else range(MAZES):
            yield from _measured(f"maze of 9 x 9 cells {number}", nine_by_nine(number))


def _measured(name: str, game: Game) -> Iterator[Measurement]:
    first: list[float] = []

    def on_progress(what: str, value: float) -> None:
        if what == "value":
            first.append(process_time() - started)

    started = process_time()
    solution = social_optimum(game, time_limit=PROOF, progress=on_progress)
    seconds = process_time() - started
    yield Measurement(f"{name}: first plans, s", first[0] if first else float("inf"), FIRST)
    is_open = solution.status is not Status.OPTIMAL
    yield Measurement(f"{name}: proof, s" + " (open)" * is_open, seconds, PROOF)
