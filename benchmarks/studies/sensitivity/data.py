"""Sensitivity of the price of selfish risk to constants and choices of the paper.

One factor at a time is changed, starting from the paper's objective and cap:

    base   margin_cap 3, horizon 15, scale exact (with the square root of two), no feedback, and
           the first speed set

The factors are the cap M', the horizon, the scale of margins (the paper's programs drop the square
root of two) and the speed set.  Costs of different levels are not comparable; ratios, as defined in
:mod:`benchmarks.studies.prices`, are.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

from benchmarks.studies.prices import (
    PLAYERS,
    Price,
    prices,
)
from benchmarks.studies.results import StudyRow
from benchmarks.studies.study import OUT_OF_REACH, StudyChoice
from benchmarks.sweeps import Cell

CAPS, HORIZONS, SCALES = (3.0, 2.0, 5.0, 8.0), (15, 20), ("exact", "paper")
"""Levels of the factors; the first is the base."""

AXES = ("scenario", "lam", "margin_cap", "horizon", "scale", "speed")
FACTORS = AXES[2:]
SIGNS = {"margin_cap": "M' = ", "horizon": "horizon ", "scale": "scale ", "speed": "speed "}
BASE = "base"

Levels = dict[str, list[Price]]
"""Prices by the name of the level."""


def cells(choice: StudyChoice) -> list[Cell]:
    """Return the cells: three players in every game of every level."""
    return [
        Cell(
            scenario,
            player,
            {**level, "objective": "margin", "gain": 0.0, "lam": lam},
            episodes=choice.episodes,
            seed=choice.seed,
        )
        for level in levels(choice.speeds)
        for scenario, lam, player in product(choice.scenarios, choice.lams, PLAYERS)
        if (scenario, level["margin_cap"]) not in OUT_OF_REACH
    ]


def levels(speeds: Sequence[str]) -> list[dict[str, Any]]:
    """Return the base, and then the base with another level of one factor."""
    choices = dict(zip(FACTORS, (CAPS, HORIZONS, SCALES, speeds), strict=True))
    base = {factor: values[0] for factor, values in choices.items()}
    others = ((factor, value) for factor, values in choices.items() for value in values[1:])
    return [base, *(base | {factor: value} for factor, value in others)]


def by_level(rows: Sequence[StudyRow], player: str) -> Levels:
    """Return the prices of the equilibria of ``player`` by level, the base first."""
    compared = prices(rows, player, AXES)
    named: Levels = {}
    for price in compared:
        changed = [f for f in FACTORS if price.selfish[f] != compared[0].selfish[f]]
        name = ", ".join(f"{SIGNS[f]}{_plain(price.selfish[f])}" for f in changed) or BASE
        named.setdefault(name, []).append(price)
    return named


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
