"""The figure of the study ``learned``: cost and crash probability over lam."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.figures import new_figure
from benchmarks.studies.learned.data import PLAYERS
from benchmarks.studies.results import StudyRow
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLES = {
    "nash": (COLOURS[1], "-", "o"),
    "social": (COLOURS[0], "-", "s"),
    "ppo-selfish": (COLOURS[4], "--", "^"),
    "ppo-social": (COLOURS[5], "--", "v"),
}
NAMES = {
    "nash": "nash (planned, tracked)",
    "social": "social (planned, tracked)",
    "ppo-selfish": "ppo-selfish (learned)",
    "ppo-social": "ppo-social (learned)",
}


def draw_speed(rows: Sequence[StudyRow], speed: str) -> Figure:
    """Draw a row of panels per scenario: expected cost and crash probability over lam."""
    shown = [row for row in rows if "players" in row]
    scenarios = list(dict.fromkeys(row["scenario"] for row in shown))
    figure = new_figure(8.2, 1.2 + 2.1 * len(scenarios))
    grid: Any = figure.subplots(len(scenarios), 2, sharex=True, squeeze=False)
    for line, scenario in zip(grid, scenarios, strict=True):
        chosen = [row for row in shown if row["scenario"] == scenario]
        floor = min(0.5 / row["episodes"] for row in chosen)
        base = np.array([row["players"]["social"]["cost"]["value"] for row in chosen])
        for name in PLAYERS:
            _curve(line[0], chosen, name, "cost", base, 0.0)
            _curve(line[1], chosen, name, "crash", np.ones(len(chosen)), floor)
        line[0].axhline(1.0, color="0.6", linewidth=0.7, zorder=0)
        line[0].set_ylabel("cost / planned social")
        line[0].set_title(scenario, fontsize=9, loc="left")
        line[1].set_yscale("log")
        line[1].set_ylabel("Pr(any overlap\nat the time steps)")
        line[1].grid(axis="y", alpha=0.3)
    for axes in grid[-1]:
        axes.set_xlabel("λ (weight of time)")
    handles, _ = grid[0][0].get_legend_handles_labels()
    figure.legend(
        handles,
        [NAMES[name] for name in PLAYERS],
        loc="outside lower center",
        ncols=2,
        fontsize=8,
    )
    figure.suptitle(f"Selfish and social, planned and learned: speed set {speed}", fontsize=10)
    return figure


def _curve(
    axes: Axes,
    rows: Sequence[StudyRow],
    name: str,
    what: str,
    base: np.ndarray,
    floor: float,
) -> None:
    """Draw a player's value over lam with its 95 % interval, with values raised to ``floor``."""
    colour, line, marker = STYLES[name]
    estimates = [row["players"][name][what] for row in rows]
    lam = [row["lam"] for row in rows]
    value, low, high = (
        np.maximum([item[key] for item in estimates], floor) / base
        for key in ("value", "low", "high")
    )
    axes.fill_between(lam, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.plot(
        lam, value, line, marker=marker, markersize=4, color=colour, linewidth=1.2, label=name
    )
