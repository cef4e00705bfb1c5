"""The figures of the study ``feedback``: costs, crash probabilities, prices and regrets."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from benchmarks.figures import new_figure
from benchmarks.studies.feedback.data import KINDS, ORACLE, SELFISH
from benchmarks.studies.feedback.marks import (
    KIND_STYLES,
    PLAYER_STYLES,
    Estimate,
    Styles,
    draw_marks,
)
from benchmarks.studies.feedback.measures import Games, ratio, regret
from benchmarks.studies.results import StudyRow
from ppg_env.support.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FLOOR = 1e-6
"""Crash probabilities below this are drawn as this."""

Panel = tuple[Estimate, str, str]
"""What is drawn, its label, and the scale of its axis."""

LETTERS = 12
"""Letters of a title per inch."""


def draw_all(games: Games, event: str) -> Mapping[str, Figure]:
    """Draw the figures of costs, crashes and prices, and of regrets where they were measured.

    ``event`` says what a crash is.
    """
    if not games:
        return {}
    crash = f"a crash is any {event}"
    figures = {
        "cost": _draw(
            games,
            PLAYER_STYLES,
            [(_cost, f"expected cost / cost of {ORACLE}", "linear")],
            f"Expected cost; {crash}",
        ),
        "risk": _draw(
            games, PLAYER_STYLES, [(_risk, "probability", "log")], f"Probability of any {event}"
        ),
        "price": _draw(
            games,
            KIND_STYLES,
            [(_price_in_cost, "cost ratio", "linear"), (_price_in_risk, "risk ratio", "log")],
            f"Selfish over social player of each kind; {crash}",
        ),
    }
    measured = {key: own for key, own in games.items() if any(map(regret, own.values()))}
    if measured:
        styles = {name: PLAYER_STYLES[name] for name in SELFISH}
        panel = (_regret, "regret (% of the mean cost)", "linear")
        title = f"Gain of an agent by its best response; {crash}"
        figures["regret"] = _draw(measured, styles, [panel], title)
    return figures


def _draw(games: Games, styles: Styles, panels: list[Panel], title: str) -> Figure:
    """Draw panels side by side, with a group of marks for each game."""
    width = (3.0 + 0.8 * len(games)) * len(panels) ** 0.8
    figure = new_figure(width, 4.0)
    grid: Any = figure.subplots(1, len(panels), squeeze=False)
    for axes, (estimate, label, scale) in zip(grid[0], panels, strict=True):
        if "/" in label or "ratio" in label:
            axes.axhline(1.0, color="0.5", linewidth=0.8, zorder=0)
        draw_marks(axes, games, styles, estimate)
        axes.set_yscale(scale)
        axes.set_ylabel(label, fontsize=8)
    handles, names = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, fontsize=8)
    lines = [*wrap(title, int(LETTERS * width)), "with 95 % limits"]
    figure.suptitle("\n".join(lines), fontsize=10)
    return figure


def _cost(own: Mapping[str, StudyRow], name: str) -> Interval | None:
    """Return the cost relative to the feedback optimum, or else to the cheapest player."""
    costs = {player: row["expected_cost"] for player, row in own.items()}
    base = costs.get(ORACLE, min(costs.values()))
    names = ("expected_cost", "expected_cost_low", "expected_cost_high")
    return Interval(*(own[name][column] / base for column in names)) if name in own else None


def _risk(own: Mapping[str, StudyRow], name: str) -> Interval | None:
    """Return the crash probability, raised to :data:`FLOOR`."""
    names = ("crash_probability", "crash_probability_low", "crash_probability_high")
    values = (max(own[name][column], FLOOR) for column in names if name in own)
    return Interval(*values) if name in own else None


def _price_in_cost(own: Mapping[str, StudyRow], kind: str) -> Interval | None:
    selfish, social = KINDS[kind]
    return ratio(own[selfish], own[social], "costs") if {selfish, social} <= set(own) else None


def _price_in_risk(own: Mapping[str, StudyRow], kind: str) -> Interval | None:
    selfish, social = KINDS[kind]
    return ratio(own[selfish], own[social], "crashes") if {selfish, social} <= set(own) else None


def _regret(own: Mapping[str, StudyRow], name: str) -> Interval | None:
    share = regret(own[name]) if name in own else None
    return share and Interval(100 * share.value, 100 * share.low, 100 * share.high)
