"""The price of selfish risk: cost and risk of an equilibrium, relative to the optimum.

A game is a scenario of the paper with a speed set, an objective, a gain and a lam.  In each, three
plans are simulated on schedule with the same noise: the equilibrium that best-response dynamics
find (``nash``), the one that minimises the potential, and the social optimum.  Ratios and
significance are defined in :mod:`benchmarks.studies.prices`.  Costs are those of the game's
objective: with ``margin`` they count missing margins, with ``risk`` they bound the expected cost.
"""

from __future__ import annotations

from itertools import product

from benchmarks.studies.prices import (
    PLAYERS,
    Price,
)
from benchmarks.studies.study import StudyChoice
from benchmarks.sweeps import Cell

OBJECTIVES = ("margin", "risk")
GAINS = (0.0, 0.5)
AXES = ("speed", "scenario", "objective", "gain", "lam")
FAMILY = AXES[:-1]
"""Games of a family differ in lam only."""


def cells(choice: StudyChoice) -> list[Cell]:
    """Return the cells: three players in every game."""
    games = product(choice.speeds, choice.scenarios, OBJECTIVES, GAINS, choice.lams)
    return [
        Cell(
            scenario,
            player,
            {"speed": speed, "objective": objective, "gain": gain, "lam": lam},
            episodes=choice.episodes,
            seed=choice.seed,
        )
        for speed, scenario, objective, gain, lam in games
        for player in PLAYERS
    ]


def family(price: Price) -> tuple[str, str, str, float]:
    """Return the family of the game of ``price``."""
    speed, scenario, objective, gain = (price.selfish[name] for name in FAMILY)
    return speed, scenario, objective, gain
