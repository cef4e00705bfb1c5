"""Marks of players with their limits, side by side in each game, for the figures of the study."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.studies.feedback.data import KINDS
from benchmarks.studies.feedback.measures import Games
from benchmarks.studies.results import StudyRow
from ppg_env.plotting import COLOURS
from ppg_env.support.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOUR = dict(zip(KINDS, (COLOURS[1], COLOURS[0], COLOURS[2]), strict=True))
Styles = dict[str, dict[str, Any]]

PLAYER_STYLES: Styles = {
    name: {"color": COLOUR[kind], "marker": marker, "markerfacecolor": face}
    for kind, pair in KINDS.items()
    for name, marker, face in zip(pair, ("^", "s"), ("white", COLOUR[kind]), strict=True)
}
"""Colours by kind; selfish players are hollow triangles, social ones squares."""

KIND_STYLES: Styles = {
    kind: {"color": COLOUR[kind], "marker": marker}
    for kind, marker in zip(KINDS, ("o", "D", "v"), strict=True)
}

WIDTH = 0.5
"""Width of the marks of one game, relative to the distance between two games."""

Estimate = Callable[[Mapping[str, StudyRow], str], Interval | None]
"""The value of a player or a kind, from the rows of a game; None if it has none."""


def draw_marks(axes: Axes, games: Games, styles: Styles, estimate: Estimate) -> None:
    """Draw the values of all ``styles`` in every game, with their limits."""
    for k, (name, style) in enumerate(styles.items()):
        values = {
            place: value
            for place, own in enumerate(games.values())
            if (value := estimate(own, name)) is not None
        }
        places = np.array(list(values)) + WIDTH * (k / (len(styles) - 1) - 0.5)
        low, high = ([getattr(v, limit) for v in values.values()] for limit in ("low", "high"))
        axes.vlines(places, low, high, color=style["color"], linewidth=1.1)
        middle = [value.value for value in values.values()]
        axes.plot(places, middle, linestyle="", markersize=5.5, label=name, **style)
    names = [f"{scenario}\n{speed}\nλ = {lam:g}" for speed, scenario, lam in games]
    axes.set_xticks(range(len(games)), names, fontsize=8)
    axes.set_xlim(-0.5, len(games) - 0.5)
    axes.tick_params(axis="y", labelsize=7)
    axes.grid(axis="y", alpha=0.3)
