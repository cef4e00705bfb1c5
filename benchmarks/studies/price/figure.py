"""The figure of the study ``price``: cost ratio and risk ratio over lam."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.figures import new_figure
from benchmarks.studies.prices import EQUILIBRIA, Price
from benchmarks.studies.ratio_panels import draw_risk, frame
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Families = Mapping[str, Mapping[tuple[str, str, str, float], Sequence[Price]]]
"""By equilibrium; then by speed set, scenario, objective and gain."""

STYLES = {
    ("nash", 0.0): (COLOURS[1], "-", "o"),
    ("potential", 0.0): (COLOURS[0], "-", "s"),
    ("nash", 0.5): (COLOURS[4], "--", "^"),
    ("potential", 0.5): (COLOURS[5], "--", "v"),
}
SHIFT = 0.008
"""Shift of neighbouring marks along lam, so that they do not hide each other."""


def draw_speed(families: Families, speed: str, event: str) -> Figure:
    """Draw a row of panels for each scenario: cost and risk ratio, for both objectives.

    ``event`` says what a crash is.
    """
    keys = [key for key in families[EQUILIBRIA[0]] if key[0] == speed]
    scenarios = list(dict.fromkeys(key[1] for key in keys))
    objectives = list(dict.fromkeys(key[2] for key in keys))
    gains = list(dict.fromkeys(key[3] for key in keys))
    figure = new_figure(4.6 * len(objectives), 1.4 + 1.9 * len(scenarios))
    grid: Any = figure.subplots(
        len(scenarios), 2 * len(objectives), sharex=True, sharey="col", squeeze=False
    )
    for line, scenario in zip(grid, scenarios, strict=True):
        line[0].set_title(scenario, fontsize=9, loc="left", fontweight="bold")
        for k, objective in enumerate(objectives):
            cost, risk = line[2 * k : 2 * k + 2]
            for j, (name, gain) in enumerate((n, g) for g in gains for n in EQUILIBRIA):
                chosen = families[name].get((speed, scenario, objective, gain), [])
                lam = np.array([price.selfish["lam"] for price in chosen])
                colour, dash, marker = STYLES[name, gain]
                style = {"color": colour, "marker": marker, "markersize": 4, "linewidth": 1.1}
                label = f"{name}, gain {gain:g}"
                cost.plot(lam, [price.cost for price in chosen], dash, label=label, **style)
                for place, price in zip(lam + (j - 1.5) * SHIFT, chosen, strict=True):
                    draw_risk(risk, place, price, style)
            frame(cost, risk, objective)
    for axes in grid[-1]:
        axes.set_xlabel("λ (weight of time)", fontsize=8)
    handles, names = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=4, fontsize=8)
    figure.suptitle(
        f"Equilibrium over optimum, speed set {speed}: sum of shifted costs, and "
        f"Pr(any {event})\nwith 95 % limits (pale: not significant)",
        fontsize=10,
    )
    return figure
