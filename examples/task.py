"""What an example trains on, and for how long: python examples/NAME.py [STEPS] [--game NAME].

Without ``--game`` it trains in ``head_on``, for the table of docs/neighbours.md.  With it, it runs
for a short time in one of five scenarios in which agents crash, arrive early and run out of time in
the same episodes.  This checks that the library's own loop goes on when agents leave, and is no
training worth a figure.
"""

from __future__ import annotations

import argparse
import os
from dataclasses import dataclass, field
from typing import Any

from ppg_env import make_game
from ppg_env.game.game import Game

ROUGH = {
    "head_on": 25.0,
    "intersection": 25.0,
    "intersection3": 25.0,
    "circle(4)": 25.0,
    "corridor": 45.0,
}
"""The scenarios of the short runs, with the half width of their arrival regions."""

NOISE, MAX_CYCLES = 200.0, 14
"""The variance of their noise per step and axis, and their number of steps."""


@dataclass(frozen=True)
class Task:
    """A game, the options of its environment, and how many steps to train."""

    game: Game
    steps: int
    rules: dict[str, Any] = field(default_factory=dict)
    rough: str = ""
    """The scenario of a short run; empty for a training."""


def rough_task(scenario: str, steps: int) -> Task:
    """Return a short run in a scenario of ``ROUGH``."""
    game = make_game(scenario, noise=NOISE)
    rules = {"tolerance": ROUGH[scenario], "max_cycles": MAX_CYCLES}
    return Task(game, steps, rules, scenario)


def read_task(steps: int) -> Task:
    """Return what the command line asks for; ``steps`` is the example's own number of them."""
    parser = argparse.ArgumentParser()
    parser.add_argument("steps", nargs="?", type=int, default=steps)
    parser.add_argument("--game", default="", choices=list(ROUGH), help="a short, rough run")
    given = parser.parse_args()
    if given.game:
        return rough_task(given.game, given.steps)
    return Task(make_game("head_on", speed="l1", lam=0.8), given.steps)


def cpu_seconds() -> float:
    """Return the CPU time of this process and of those that it started and that have ended."""
    return sum(os.times()[:4])
