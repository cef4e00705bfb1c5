"""The figure of regrets of the study ``learned``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.figures import new_figure
from benchmarks.studies.learned.data import SELFISH
from benchmarks.studies.learned.marks import STYLES, finish, mark
from benchmarks.studies.learned.measures import Games, Key, regret
from ppg_env.support.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 0.36
"""Width of the marks of one game, relative to the distance between two games."""

TICKS = (0, 0.1, 0.3, 1, 3, 10, 30)
"""Regrets at which the axis has a tick, in percent."""


def draw_regrets(games: Games, title: str) -> Figure:
    """Draw the regrets of the selfish players, one group of marks for each game."""
    measured: list[Key] = [
        key for key, own in games.items() if any(regret(row) for row in own.values())
    ]
    figure = new_figure(2.0 + 0.75 * len(measured), 3.9)
    axes = figure.subplots()
    handles: dict[str, Any] = {}
    for k, name in enumerate(SELFISH):
        shares = {
            place: share
            for place, key in enumerate(measured)
            if name in games[key] and (share := regret(games[key][name])) is not None
        }
        places = np.array(list(shares)) + WIDTH * (k / (len(SELFISH) - 1) - 0.5)
        style = STYLES[name] | {"linestyle": ""}
        percent = [Interval(100 * s.value, 100 * s.low, 100 * s.high) for s in shares.values()]
        mark(axes, places, percent, style, name, handles)
    axes.axhline(1.0, color="0.5", linewidth=0.8, linestyle=":", zorder=0)
    axes.set_yscale("symlog", linthresh=0.1)
    axes.set_yticks(TICKS, [f"{tick:g}" for tick in TICKS])
    axes.set_ylim(bottom=0)
    names = [f"{scenario}\n{speed}\nλ = {lam:g}" for speed, scenario, lam in measured]
    axes.set_xticks(range(len(measured)), names, fontsize=7)
    axes.set_ylabel("regret (% of the cost)", fontsize=8)
    axes.tick_params(axis="y", labelsize=7)
    axes.grid(axis="y", alpha=0.3)
    finish(figure, handles, title)
    return figure
