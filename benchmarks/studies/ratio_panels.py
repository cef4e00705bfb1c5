"""Panels of cost ratios and risk ratios, as the studies of prices draw them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.studies.prices import Price

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RANGE = (3e-4, 3e4)
"""Range of the risk ratios on the axis; values beyond it are drawn at its ends."""


def frame(cost: Axes, risk: Axes, objective: str) -> None:
    """Set labels and scales of a panel of cost ratios and one of risk ratios; draw lines at one."""
    for axes, what in ((cost, "cost ratio"), (risk, "risk ratio")):
        axes.axhline(1.0, color="0.5", linewidth=0.8, zorder=0)
        axes.set_ylabel(f"{what} ({objective})", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(axis="y", alpha=0.3)
    risk.set_yscale("log")
    risk.set_ylim(*RANGE)


def draw_risk(axes: Axes, place: float, price: Price, style: dict[str, Any]) -> None:
    """Draw the risk ratio with its limits; pale unless the risks differ significantly."""
    pale = {"alpha": 1.0 if price.significant else 0.25}
    bar = style | pale | {"marker": "", "linestyle": "-"}
    axes.plot([place, place], np.clip([price.least, price.most], *RANGE), **bar)
    axes.plot(place, price.risk, **style | pale)
