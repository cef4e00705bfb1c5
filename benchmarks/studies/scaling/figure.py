"""The figure of the study ``scaling``: four panels over the size of the games."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from benchmarks.figures import new_figure
from benchmarks.studies.prices import Price
from benchmarks.studies.results import StudyRow
from benchmarks.studies.scaling.data import LIMIT, LONG, PLAYERS, size_of
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = "osD"
DASHES = dict(zip(PLAYERS, ("-", "--"), strict=True))


def draw_growth(
    families: Mapping[str, Sequence[tuple[StudyRow, StudyRow | None]]], event: str
) -> Figure:
    """Draw families that grow in N on the left, the one whose horizon grows on the right.

    ``event`` says what a crash is.
    """
    wide = [("agents N", [f for f in families if f != LONG]), ("horizon (steps)", [LONG])]
    shown = [(what, names) for what, names in wide if any(name in families for name in names)]
    figure = new_figure(1.5 + 3.6 * len(shown), 8.6)
    grid: Any = figure.subplots(4, len(shown), sharex="col", sharey="row", squeeze=False)
    for column, (what, names) in enumerate(shown):
        seconds, gap, cost, risk = (line[column] for line in grid)
        for family in names:
            k = list(families).index(family)
            _draw(families[family], family, COLOURS[k], MARKERS[k], (seconds, gap, cost, risk))
        seconds.axhline(LIMIT, color="0.5", linewidth=0.8, zorder=0)
        seconds.set_yscale("log")
        risk.set_yscale("log")
        for axes in (cost, risk):
            axes.axhline(1.0, color="0.5", linewidth=0.8, zorder=0)
        for axes in (seconds, gap, cost, risk):
            axes.grid(alpha=0.3)
            axes.tick_params(labelsize=7)
        seconds.legend(fontsize=7)
        risk.set_xlabel(what, fontsize=8)
    heads = ("seconds (one processor)", "gap of social (%)", "cost ratio", "risk ratio")
    for line, name in zip(grid, heads, strict=True):
        line[0].set_ylabel(name, fontsize=8)
    figure.suptitle(
        "Planners and the price of selfishness, nash over social\n"
        f"(risk: any {event}, with 95 % limits)",
        fontsize=9,
    )
    return figure


def _draw(
    pairs: Sequence[tuple[StudyRow, StudyRow | None]],
    family: str,
    colour: str,
    marker: str,
    panels: tuple[Axes, Axes, Axes, Axes],
) -> None:
    seconds, gap, cost, risk = panels
    style: dict[str, Any] = {"color": colour, "marker": marker, "markersize": 4, "linewidth": 1.1}
    for k, name in enumerate(PLAYERS):
        own = [row for pair in pairs if (row := pair[k]) is not None]
        sizes = [size_of(row) for row in own]
        label = f"{family}, {name}"
        seconds.plot(sizes, [r["seconds"] for r in own], DASHES[name], label=label, **style)
    both = [(size_of(nash), Price(nash, social)) for nash, social in pairs if social is not None]
    sizes = [size for size, _ in both]
    gap.plot(sizes, [100 * price.social["gap"] for _, price in both], **style)
    cost.plot(sizes, [price.cost for _, price in both], **style)
    risk.plot(sizes, [price.risk for _, price in both], **style)
    for size, price in both:
        risk.plot([size] * 2, [price.least, price.most], color=colour, linewidth=1)
