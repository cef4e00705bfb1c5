"""The figure of the study ``liability``: cost gap and risk ratio by rule."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.figures import new_figure
from benchmarks.studies.liability.data import RESTORED, RULES, GameUnderRules, worst
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = "osD^vPXh"
TICKS = [rule.replace(":", "\n").replace("right-of-", "right-of-\n") for rule in RULES]


def draw_games(
    societies: Sequence[tuple[tuple[str, str, float], Sequence[GameUnderRules]]], event: str
) -> Figure:
    """Draw a row of panels of cost gaps and one of risk ratios; a column for each society.

    ``event`` says what a crash is.
    """
    figure = new_figure(1.2 + 3.3 * len(societies), 6.0)
    grid: Any = figure.subplots(2, len(societies), sharex=True, sharey="row", squeeze=False)
    for column, ((_, kind, lam), games) in enumerate(societies):
        gap, risk = grid[0][column], grid[1][column]
        gap.set_title(f"agents {kind}, λ {'≈' if kind == 'unlike' else '='} {lam:g}", fontsize=9)
        for k, game in enumerate(games):
            _draw_game(gap, risk, game, k, (k - (len(games) - 1) / 2) * 0.08)
        gap.axhline(100 * RESTORED, color="0.5", linewidth=0.8, zorder=0)
        gap.set_yscale("symlog", linthresh=100 * RESTORED)
        risk.axhline(1.0, color="0.5", linewidth=0.8, zorder=0)
        risk.set_yscale("log")
        risk.set_xticks(range(len(RULES)), TICKS, fontsize=7)
        for axes in (gap, risk):
            axes.tick_params(axis="y", labelsize=7)
            axes.grid(axis="y", alpha=0.3)
    largest = [game.gaps(rule)[1] for _, games in societies for game in games for rule in RULES]
    settled = [100 * gap for gap in largest if gap < inf]
    grid[0][0].set_ylim(-0.02, 2 * max(settled, default=1.0) + 1)
    grid[0][0].set_ylabel("cost gap (%)", fontsize=8)
    grid[1][0].set_ylabel("risk ratio", fontsize=8)
    handles, names = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=4, fontsize=8)
    figure.suptitle(
        "Equilibria under liability rules, relative to the cheapest plans known:\n"
        f"sum of shifted costs, and Pr(any {event})",
        fontsize=9,
    )
    return figure


def _draw_game(gap: Axes, risk: Axes, game: GameUnderRules, k: int, shift: float) -> None:
    """Draw cost gaps and risk ratios of the ``k``-th game, shifted from the ticks of the rules."""
    style: dict[str, Any] = {
        "color": COLOURS[k % len(COLOURS)],
        "marker": MARKERS[k % len(MARKERS)],
        "linestyle": ("-", "--")[game.agents > 3],
        "markersize": 4,
        "linewidth": 1.1,
    }
    places = np.arange(len(RULES)) + shift
    gaps = 100 * np.array([game.gaps(rule) for rule in RULES])
    gap.vlines(places, *gaps.T, color=style["color"], linewidth=1.1)
    gap.plot(places, gaps[:, 1], label=f"{game.scenario}, N = {game.agents}", **style)
    prices = [worst(game, rule) for rule in RULES]
    ratios = [np.nan if price is None else price.risk for price in prices]
    risk.plot(places, ratios, **style)
