"""Styles, marks and legends of the figures of the study ``learned``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.studies.learned.data import KINDS, PLAYERS
from ppg_env.plotting import COLOURS
from ppg_env.support.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOUR = dict(zip(KINDS, (COLOURS[1], COLOURS[0], COLOURS[2]), strict=True))
STYLES: dict[str, dict[str, Any]] = {
    name: {"color": COLOUR[kind], "linestyle": line, "marker": marker, "markerfacecolor": face}
    for kind, pair in KINDS.items()
    for name, line, marker, face in zip(
        pair, ("--", "-"), ("^", "s"), ("white", COLOUR[kind]), strict=True
    )
}
"""Colours by kind; selfish players are dashed and hollow."""


def mark(
    axes: Axes,
    places: np.ndarray,
    values: list[Interval],
    style: dict[str, Any],
    name: str,
    handles: dict[str, Any],
) -> None:
    """Draw values with their limits."""
    low, high = ([getattr(value, limit) for value in values] for limit in ("low", "high"))
    axes.vlines(places, low, high, color=style["color"], linewidth=1.0)
    (handles[name],) = axes.plot(
        places, [value.value for value in values], markersize=4.5, linewidth=1.1, **style
    )


def finish(figure: Figure, handles: dict[str, Any], title: str) -> None:
    """Add the legend and the title."""
    names = [name for name in PLAYERS if name in handles]
    figure.legend(
        [handles[name] for name in names], names, loc="outside lower center", ncols=3, fontsize=8
    )
    figure.suptitle(title, fontsize=10)
