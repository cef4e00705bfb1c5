"""The figure of the study ``tightness``: bounds and counts of every plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.figures import new_figure
from benchmarks.studies.results import StudyRow
from benchmarks.studies.tightness.data import BOUNDS, OBJECTIVES
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLES = {
    "union": (COLOURS[1], "o", "the paper's bound"),
    "faces": (COLOURS[4], "^", "best faces, margins not capped"),
    "instants": (COLOURS[2], "D", "sum of exact instants"),
    "tree": (COLOURS[0], "|", "minus the overlap of events (tightest)"),
}
LEFT = 1e-18
"""Left end of the axis; smaller bounds are drawn there."""


def draw_speed(rows: Sequence[StudyRow], speed: str, event: str) -> Figure:
    """Draw panels by scenario and objective, with a row of markers for every plan.

    ``event`` says what a crash is.
    """
    shown = [row for row in rows if "bounds" in row]
    scenarios = list(dict.fromkeys(row["scenario"] for row in shown))
    most = max(sum(r["scenario"] == s and r["objective"] == OBJECTIVES[0] for r in shown)
               for s in scenarios)  # fmt: skip
    figure = new_figure(9.0, 1.3 + len(scenarios) * (0.5 + 0.17 * most))
    grid: Any = figure.subplots(len(scenarios), len(OBJECTIVES), sharex=True, squeeze=False)
    for line, scenario in zip(grid, scenarios, strict=True):
        for axes, objective in zip(line, OBJECTIVES, strict=True):
            chosen = [
                row for row in shown if (row["scenario"], row["objective"]) == (scenario, objective)
            ]
            _panel(axes, chosen)
            axes.set_title(f"{scenario}, objective {objective}", fontsize=9, loc="left")
    for axes in grid[-1]:
        axes.set_xlabel(f"Pr(any {event}); at the left end: or less", fontsize=8)
    handles, names = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, fontsize=8)
    figure.suptitle(f"How tight the bounds are: speed set {speed}", fontsize=10)
    return figure


def _panel(axes: Axes, rows: Sequence[StudyRow]) -> None:
    places = np.arange(len(rows))
    for name in BOUNDS:
        colour, marker, label = STYLES[name]
        values = np.maximum([row["bounds"][name] for row in rows], LEFT)
        size = 11 if marker == "|" else 4
        axes.plot(values, places, marker, color=colour, markersize=size, label=label)
    counted = np.array([row["hits"] > 0 for row in rows], dtype=bool)
    value, low, high = (
        np.array([row["hits"] / row["episodes"] if key == "value" else row[key] for row in rows])
        for key in ("value", "low", "high")
    )
    spread = np.array([value - low, high - value])[:, counted]
    axes.errorbar(
        value[counted], places[counted], xerr=spread, fmt="x", color="black", markersize=5,
        linewidth=0.8, capsize=2, label="counted, 95 % interval",
    )  # fmt: skip
    axes.plot(
        high[~counted],
        places[~counted],
        "4",
        color="black",
        markersize=6,
        label="no crash counted: below",
    )
    axes.set_xscale("log")
    axes.set_xlim(LEFT / 3, 2.0)
    names = [f"{row['player']}, λ {row['lam']:g}, gain {row['gain']:g}" for row in rows]
    axes.set_yticks(places, names, fontsize=6)
    axes.invert_yaxis()
    axes.grid(axis="x", alpha=0.3)
