"""The figure of the study ``sensitivity``: cost ratio and risk ratio at every level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from benchmarks.figures import new_figure
from benchmarks.studies.prices import EQUILIBRIA, Price
from benchmarks.studies.ratio_panels import draw_risk, frame
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOUR = {"nash": COLOURS[1], "potential": COLOURS[0]}
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
"""A marker for each lam."""

WIDTH = 0.6
"""Width of the marks of one level, relative to the distance between two levels."""


def draw_levels(prices: Mapping[str, Mapping[str, Sequence[Price]]], event: str) -> Figure:
    """Draw a row of panels for each scenario, from prices by equilibrium and level.

    ``event`` says what a crash is.
    """
    every = [price for some in prices.values() for chosen in some.values() for price in chosen]
    levels = list(prices[EQUILIBRIA[0]])
    scenarios = list(dict.fromkeys(price.selfish["scenario"] for price in every))
    lams = list(dict.fromkeys(price.selfish["lam"] for price in every))
    kinds = [(name, lam) for name in EQUILIBRIA for lam in lams]
    figure = new_figure(9.0, 1.8 + 1.7 * len(scenarios))
    grid: Any = figure.subplots(len(scenarios), 2, sharex=True, sharey="col", squeeze=False)
    for line, scenario in zip(grid, scenarios, strict=True):
        cost, risk = line
        cost.set_title(scenario, fontsize=9, loc="left", fontweight="bold")
        for k, (name, lam) in enumerate(kinds):
            style = {
                "color": COLOUR[name],
                "marker": MARKERS[lams.index(lam) % len(MARKERS)],
                "markersize": 4,
                "linestyle": "",
                "markerfacecolor": COLOUR[name] if name == EQUILIBRIA[0] else "white",
            }
            label = f"{name}, λ = {lam:g}"
            for level, chosen in prices[name].items():
                for price in chosen:
                    if (price.selfish["scenario"], price.selfish["lam"]) != (scenario, lam):
                        continue
                    place = levels.index(level) + WIDTH * (k / max(len(kinds) - 1, 1) - 0.5)
                    cost.plot(place, price.cost, label=label, **style)
                    draw_risk(risk, place, price, style)
        frame(cost, risk, "margin")
    for axes in grid[-1]:
        axes.set_xticks(range(len(levels)), levels, fontsize=7, rotation=30, ha="right")
        axes.set_xlabel("difference from the base", fontsize=8)
    handles = dict(zip(*reversed(grid[0][0].get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3, fontsize=8)
    figure.suptitle(
        f"Equilibrium over optimum: sum of shifted costs, and Pr(any {event})\n"
        "with 95 % limits (pale: not significant)",
        fontsize=10,
    )
    return figure
