"""The figure of the study ``atlas``: cost and risk of all equilibria of a game."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from benchmarks.figures import new_figure
from benchmarks.studies.atlas.data import EquilibriumKind, GameEquilibria
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDE = 3
"""Largest number of panels in a row."""

NAMED = 5
"""Number of kinds of a game with a colour and a name of their own, the most frequent ones."""

MARKERS = "osD^v"
AREA = 400.0
"""Area of a mark for all runs, in square points."""


def draw_atlas(games: Sequence[GameEquilibria], event: str) -> Figure:
    """Draw every equilibrium as a mark whose area is its share of the runs.

    ``event`` says what a crash is.
    """
    lines = -(-len(games) // WIDE)
    figure = new_figure(3.6 * min(len(games), WIDE), 0.8 + 3.3 * lines)
    grid: Any = figure.subplots(lines, min(len(games), WIDE), squeeze=False)
    for axes, game in zip(grid.flat, games, strict=False):
        common = sorted(game.kinds, key=lambda kind: -kind.share(game.runs))
        for k, kind in enumerate(common):
            named = k < NAMED
            for row, share in _shares(game, kind):
                low, high = row["crash_probability_low"], row["crash_probability_high"]
                value = row["crash_probability"] or high
                colour = COLOURS[k] if named else "0.6"
                axes.vlines(row["social_cost"], low or value / 10, high, color=colour, linewidth=1)
                axes.scatter(
                    row["social_cost"],
                    value,
                    s=20 + AREA * share,
                    marker=MARKERS[k] if named else ".",
                    facecolors="none",
                    edgecolors=colour,
                    linewidths=1.3,
                )
            label = f"{kind.name} ({kind.share(game.runs):.0%})" if named else None
            axes.plot([], [], MARKERS[k] if named else ".", color=COLOURS[k % 8], label=label)
        axes.set_yscale("log")
        axes.margins(x=0.15)
        low, high = axes.get_ylim()
        axes.set_ylim(low / 4, high * 4)  # at least a decade, with room for the names
        axes.set_title(game.name, fontsize=9)
        axes.set_xlabel("social cost (sum of shifted costs)", fontsize=8)
        axes.set_ylabel(f"Pr(any {event})", fontsize=8)
        axes.tick_params(labelsize=7, which="both")
        axes.grid(alpha=0.3)
        if max(map(len, (kind.name for kind in common[:NAMED])), default=0) < 40:
            axes.legend(fontsize=6)
    for axes in grid.flat[len(games) :]:
        axes.set_axis_off()
    figure.suptitle(
        "Equilibria by the sides on which agents pass; area: share of runs that end there; "
        "bars: 95 % limits",
        fontsize=9,
    )
    return figure


def _shares(game: GameEquilibria, kind: EquilibriumKind) -> list[tuple[dict[str, Any], float]]:
    """Return each equilibrium of a kind, with the share of all runs that ended in it."""
    distinct, shares = kind.distinct, []
    for k, row in enumerate(distinct):
        top = distinct[k + 1]["social_cost"] if k + 1 < len(distinct) else float("inf")
        here = [r for r in kind.rows if row["social_cost"] <= r["social_cost"] < top]
        shares.append((row, len(here) / len(game.runs)))
    return shares
