"""The paper's figures, objective, time and safety over lam, with the crash probability added.

There is one figure per setting and gain, with a row of panels per scenario.  Thick lines are
averages over the agents, as in the paper, thin lines single agents; the band spans all equilibria
found.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.figures import new_figure
from benchmarks.reproduction.curves import Curve, Panel
from benchmarks.reproduction.extent import BEST_RESPONSE, EQUILIBRIA, POTENTIAL, SOCIAL
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLES = {
    SOCIAL: (COLOURS[0], "-", "s"),
    BEST_RESPONSE: (COLOURS[1], "-", "o"),
    POTENTIAL: (COLOURS[2], "--", "^"),
}
"""Colour, line and marker: colour is never the only distinction."""

LEAST_SPAN = 0.1
"""Least span of an axis, in steps or units of margin."""

WIDTH = 11.0
LEFT, RIGHT, BOTTOM, TOP = 0.7, 0.1, 0.9, 0.8
"""Inches; the margins leave room for labels, titles and the legend."""

COLUMNS = {
    "objective": "(a) objective, shifted\n(steps)",
    "time": "(b) time to goal\n(steps)",
    "safety": "(c) safety lost, $\\Sigma\\,(M' - s)$\n(units of $\\sqrt{2}\\,\\sigma$)",
    "crash": "(d) probability per episode of any\n{event}",
}


def draw(panels: Sequence[Panel], event: str) -> Figure:
    """Draw the panels of one setting and gain, a row each; lower is better in all of them.

    ``event`` says what a crash is.
    """
    height = TOP + 1.75 * len(panels) + BOTTOM
    figure = new_figure(WIDTH, height)
    figure.set_layout_engine("none")  # fitting a layout takes longer than drawing
    edges = {
        "left": LEFT / WIDTH,
        "right": 1 - RIGHT / WIDTH,
        "bottom": BOTTOM / height,
        "top": 1 - TOP / height,
        "wspace": 0.36,
        "hspace": 0.12,
    }
    shape = (len(panels), len(COLUMNS))
    grid: Any = figure.subplots(*shape, sharex=True, squeeze=False, gridspec_kw=edges)
    for line, panel in zip(grid, panels, strict=True):
        for axes, quantity in zip(line, COLUMNS, strict=True):
            if quantity == "crash":
                _crashes(axes, panel)
            else:
                _averages(axes, panel, quantity)
                _widen(axes)
            axes.grid(axis="y", alpha=0.3)
            axes.margins(x=0.03)
            axes.tick_params(which="both", labelsize=8)
        line[0].set_ylabel(panel.place.scenario, fontsize=10)
    for axes, title in zip(grid[0], COLUMNS.values(), strict=True):
        axes.set_title(title.replace("{event}", event), fontsize=9)
    for axes in grid[-1]:
        axes.set_xlabel("λ (weight of time)", fontsize=8)
    handles, labels = grid[0][-1].get_legend_handles_labels()
    band = grid[0][0].collections[0]
    figure.legend(
        [*handles, band],
        [*labels, "all equilibria found"],
        loc="lower center",
        ncols=5,
        fontsize=8,
    )
    place = panels[0].place
    title = f"Selfish and social plans: {place.setting}, K = {place.gain:g}"
    figure.suptitle(title, fontsize=11, y=1 - 0.1 / height)
    return figure


def _averages(axes: Axes, panel: Panel, quantity: str) -> None:
    low, high = panel.band(quantity)
    axes.fill_between(panel.lams, low, high, color="0.6", alpha=0.35, linewidth=0)
    for name, (colour, line, marker) in STYLES.items():
        curve = panel.curves[name]
        if name != POTENTIAL:  # a third bundle of thin lines would hide the others
            axes.plot(
                panel.lams, getattr(curve, quantity), line, color=colour, linewidth=0.6, alpha=0.5
            )
        axes.plot(
            panel.lams,
            curve.mean(quantity),
            line,
            color=colour,
            marker=marker,
            markersize=4,
            linewidth=1.4,
        )


def _widen(axes: Axes) -> None:
    """Widen the vertical axis, so that rounding errors do not fill the panel."""
    low, high = axes.get_ylim()
    if high - low < LEAST_SPAN:
        middle = (low + high) / 2
        axes.set_ylim(middle - LEAST_SPAN / 2, middle + LEAST_SPAN / 2)


def _crashes(axes: Axes, panel: Panel) -> None:
    low = _extreme(panel, np.fmin.reduce)
    high = _extreme(panel, np.fmax.reduce)
    axes.fill_between(panel.lams, low, high, color="0.6", alpha=0.35, linewidth=0)
    for name, (colour, line, marker) in STYLES.items():
        curve = panel.curves[name]
        value, lower, upper = _shown(curve)
        axes.errorbar(
            panel.lams,
            value,
            yerr=np.maximum(
                [value - lower, upper - value], 0.0
            ),  # rounding may give negative lengths
            fmt=line,
            color=colour,
            marker=marker,
            markersize=4,
            linewidth=1.2,
            elinewidth=0.8,
            label=name,
        )
        axes.plot(panel.lams, curve.risk_bound, ":", color=colour, linewidth=1.0)
    axes.plot([], [], ":", color="0.3", linewidth=1.0, label="union bounds")
    axes.set_yscale("log")


def _shown(curve: Curve) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return value and limits; without crashes, the upper limit for all three."""
    value, low, high = curve.crash.T
    counted = value > 0
    least = np.where(counted, np.maximum(low, high / 1e6), high)
    return np.where(counted, value, high), least, high


def _extreme(panel: Panel, reduce: Any) -> np.ndarray:
    values: np.ndarray = reduce([_shown(panel.curves[name])[0] for name in EQUILIBRIA])
    return values
