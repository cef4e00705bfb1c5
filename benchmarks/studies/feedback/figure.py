"""The figures of the study ``feedback``: cost, crash probability and regret over lam."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from benchmarks.figures import new_figure
from benchmarks.studies.feedback.data import (
    KINDS,
    ORACLE,
    PLAYERS,
    SELFISH,
    Games,
    largest_regret,
)
from benchmarks.studies.results import StudyRow
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOUR = dict(zip(KINDS, (COLOURS[1], COLOURS[3], COLOURS[2], COLOURS[0]), strict=True))
STYLES = {
    name: (COLOUR[kind], line, marker)
    for kind, pair in KINDS.items()
    for name, line, marker in zip(pair, ("--", "-"), ("^", "s"), strict=True)
}
"""Colours by kind; selfish players are dashed."""

LABELS = {
    "cost": f"cost / cost of {ORACLE}",
    "risk": "Pr(any agent crashes)",
    "regret": "gain by the best response found / cost",
}


def draw_all(games: Games) -> Mapping[str, Figure]:
    """Draw the three figures, with a row of panels per scenario and a column per speed set."""
    return {what: _draw(games, what) for what in LABELS if _panels(games, what)[0]}


def _panels(games: Games, what: str) -> tuple[list[str], list[str]]:
    """Return the scenarios and speed sets with anything to draw."""
    shown = [
        key
        for key, rows in games.items()
        if what != "regret" or any(largest_regret(row) is not None for row in rows.values())
    ]
    return list(dict.fromkeys(k[1] for k in shown)), list(dict.fromkeys(k[0] for k in shown))


def _draw(games: Games, what: str) -> Figure:
    scenarios, speeds = _panels(games, what)
    figure = new_figure(1.0 + 2.7 * len(speeds), 1.3 + 1.75 * len(scenarios))
    grid: Any = figure.subplots(
        len(scenarios), len(speeds), sharex=True, sharey="row", squeeze=False
    )
    handles: dict[str, Any] = {}
    for line, scenario in zip(grid, scenarios, strict=True):
        for axes, speed in zip(line, speeds, strict=True):
            _panel(axes, games, (speed, scenario), what, handles)
            axes.set_title(f"{scenario}, {speed}", fontsize=8, loc="left")
            axes.tick_params(labelsize=7)
            axes.grid(axis="y", alpha=0.3)
    for axes in grid[-1]:
        axes.set_xlabel("λ (weight of time)", fontsize=8)
    figure.supylabel(LABELS[what], fontsize=9)
    names = [name for name in PLAYERS if name in handles]
    chosen = [handles[name] for name in names]
    figure.legend(chosen, names, loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _panel(
    axes: Axes, games: Games, place: tuple[str, str], what: str, handles: dict[str, Any]
) -> None:
    """Draw the curves of one scenario and speed set."""
    here = {key[2]: rows for key, rows in games.items() if key[:2] == place}
    for name in SELFISH if what == "regret" else PLAYERS:
        values = {lam: _value(rows, name, what) for lam, rows in here.items() if name in rows}
        drawn = {lam: value for lam, value in values.items() if value is not None}
        if drawn:
            colour, line, marker = STYLES[name]
            style = {"marker": marker, "markersize": 3.5, "color": colour, "linewidth": 1.1}
            (handles[name],) = axes.plot(list(drawn), list(drawn.values()), line, **style)
    if what == "risk":
        axes.set_yscale("log")
    if what == "cost":
        axes.axhline(1.0, color="0.6", linewidth=0.7, zorder=0)


def _value(rows: Mapping[str, StudyRow], name: str, what: str) -> float | None:
    """Return the value to draw; costs are relative to the oracle, or else to the least cost."""
    row = rows[name]
    if what == "regret":
        return largest_regret(row)
    if what == "risk":
        return float(max(row["crash_probability"], 0.5 / row["episodes"]))
    base = rows.get(ORACLE) or min(rows.values(), key=lambda other: other["expected_cost"])
    return float(row["expected_cost"] / base["expected_cost"])
