"""The figures of the study ``learned``: cost and crash probability over lam, and regret."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.figures import new_figure
from benchmarks.studies.learned.data import ORACLE, PLAYERS
from benchmarks.studies.learned.marks import STYLES, finish, mark
from benchmarks.studies.learned.measures import Games, regret
from benchmarks.studies.learned.regret_figure import draw_regrets
from benchmarks.studies.results import StudyRow
from ppg_env.support.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHIFT = 0.007
"""Shift of neighbouring marks along lam, so that they do not hide each other."""

FLOOR = 1e-6
"""Crash probabilities below this are drawn as this."""

Estimate = Callable[[Mapping[str, StudyRow], str], Interval]
"""The value of a player, from the rows of a game."""


def draw_all(games: Games, event: str) -> Mapping[str, Figure]:
    """Draw the figures of costs, of crash probabilities, and of regrets where there are any.

    ``event`` says what a crash is.
    """
    if not games:
        return {}
    base = ORACLE if all(ORACLE in own for own in games.values()) else "the cheapest player"
    titles = {
        "cost": f"Expected cost (a crash is any {event}) over that of {base}",
        "risk": f"Probability of any {event}, at least {FLOOR:.0e}",
        "regret": "Gain of an agent by its best response, relative to the mean cost\n"
        f"(costs count time and any {event})",
    }
    figures = {
        "cost": _over_lam(games, _cost, titles["cost"]),
        "risk": _over_lam(games, _risk, titles["risk"]),
    }
    for axes in figures["risk"].axes:
        axes.set_yscale("log")
    if any(regret(row) for own in games.values() for row in own.values()):
        figures["regret"] = draw_regrets(games, titles["regret"])
    return figures


def _over_lam(games: Games, estimate: Estimate, title: str) -> Figure:
    """Draw a row of panels per scenario and a column per speed set."""
    scenarios = list(dict.fromkeys(scenario for _, scenario, _ in games))
    speeds = list(dict.fromkeys(speed for speed, _, _ in games))
    figure = new_figure(1.2 + 3.5 * len(speeds), 1.4 + 2.2 * len(scenarios))
    grid: Any = figure.subplots(
        len(scenarios), len(speeds), sharex=True, sharey="row", squeeze=False
    )
    handles: dict[str, Any] = {}
    for line, scenario in zip(grid, scenarios, strict=True):
        for axes, speed in zip(line, speeds, strict=True):
            _panel(axes, games, (speed, scenario), estimate, handles)
            axes.set_title(f"{scenario}, speed {speed}", fontsize=9, loc="left")
            axes.tick_params(labelsize=7)
            axes.grid(axis="y", alpha=0.3)
    for axes in grid[-1]:
        axes.set_xlabel("λ (weight of time)", fontsize=8)
    finish(figure, handles, title + ", with 95 % limits")
    return figure


def _panel(
    axes: Axes,
    games: Games,
    place: tuple[str, str],
    estimate: Estimate,
    handles: dict[str, Any],
) -> None:
    """Draw the values of all players over lam in one scenario with one speed set."""
    here = {key[2]: own for key, own in games.items() if key[:2] == place}
    for k, name in enumerate(PLAYERS):
        points = {lam: estimate(own, name) for lam, own in here.items() if name in own}
        if points:
            lams = np.array(list(points)) + (k - (len(PLAYERS) - 1) / 2) * SHIFT
            mark(axes, lams, list(points.values()), STYLES[name], name, handles)


def _cost(own: Mapping[str, StudyRow], name: str) -> Interval:
    """Return the cost relative to the feedback optimum, or else to the cheapest player."""
    costs = {player: row["expected_cost"] for player, row in own.items()}
    base = costs.get(ORACLE, min(costs.values()))
    names = ("expected_cost", "expected_cost_low", "expected_cost_high")
    return Interval(*(own[name][column] / base for column in names))


def _risk(own: Mapping[str, StudyRow], name: str) -> Interval:
    """Return the crash probability, raised to :data:`FLOOR`."""
    names = ("crash_probability", "crash_probability_low", "crash_probability_high")
    return Interval(*(max(own[name][column], FLOOR) for column in names))
