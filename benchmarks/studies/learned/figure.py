"""The figures of the study ``learned``: cost and crash probability over lam, and regret."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.figures import new_figure
from benchmarks.studies.learned.data import KINDS, ORACLE, PLAYERS, SELFISH, Games, Key, regret
from benchmarks.studies.results import StudyRow
from ppg_env.plotting import COLOURS
from ppg_env.support.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOUR = dict(zip(KINDS, (COLOURS[1], COLOURS[0], COLOURS[2]), strict=True))
STYLES: dict[str, dict[str, Any]] = {
    name: {"color": COLOUR[kind], "linestyle": line, "marker": marker, "markerfacecolor": face}
    for kind, pair in KINDS.items()
    for name, line, marker, face in zip(
        pair, ("--", "-"), ("^", "s"), ("white", COLOUR[kind]), strict=True
    )
}
"""Colours by kind; selfish players are dashed and hollow."""

SHIFT = 0.007
"""Shift of neighbouring marks along lam, so that they do not hide each other."""

WIDTH = 0.36
"""Width of the marks of one game, relative to the distance between two games."""

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
        "risk": f"Probability of any {event}",
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
        figures["regret"] = _regrets(games, titles["regret"])
    return figures


def _over_lam(games: Games, estimate: Estimate, title: str) -> Figure:
    """Draw a row of panels per scenario and a column per speed set."""
    scenarios, speeds = (list(dict.fromkeys(key[k] for key in games)) for k in (1, 0))
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
    _finish(figure, handles, title + ", with 95 % limits")
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
            _mark(axes, lams, list(points.values()), STYLES[name], name, handles)


def _mark(
    axes: Axes,
    places: np.ndarray,
    values: list[Interval],
    style: dict[str, Any],
    name: str,
    handles: dict[str, Any],
) -> None:
    """Draw values with their limits."""
    low, high = ([getattr(value, limit) for value in values] for limit in ("low", "high"))
    axes.vlines(places, low, high, color=style["color"], linewidth=1.0)
    (handles[name],) = axes.plot(
        places, [value.value for value in values], markersize=4.5, linewidth=1.1, **style
    )


def _cost(own: Mapping[str, StudyRow], name: str) -> Interval:
    """Return the cost relative to the feedback optimum, or else to the cheapest player."""
    costs = {player: row["expected_cost"] for player, row in own.items()}
    base = costs.get(ORACLE, min(costs.values()))
    names = ("expected_cost", "expected_cost_low", "expected_cost_high")
    return Interval(*(own[name][column] / base for column in names))


def _risk(own: Mapping[str, StudyRow], name: str) -> Interval:
    """Return the crash probability; zero is raised to a tenth of its upper limit."""
    names = ("crash_probability", "crash_probability_low", "crash_probability_high")
    value, low, high = (own[name][column] for column in names)
    return Interval(max(value, high / 10), max(low, high / 100), high)


def _regrets(games: Games, title: str) -> Figure:
    """Draw the regrets of the selfish players, one group of marks for each game."""
    measured: list[Key] = [
        key for key, own in games.items() if any(regret(row) for row in own.values())
    ]
    figure = new_figure(2.0 + 0.75 * len(measured), 3.9)
    axes = figure.subplots()
    handles: dict[str, Any] = {}
    for k, name in enumerate(SELFISH):
        shares = {
            place: share
            for place, key in enumerate(measured)
            if name in games[key] and (share := regret(games[key][name])) is not None
        }
        places = np.array(list(shares)) + WIDTH * (k / (len(SELFISH) - 1) - 0.5)
        style = STYLES[name] | {"linestyle": ""}
        percent = [Interval(100 * s.value, 100 * s.low, 100 * s.high) for s in shares.values()]
        _mark(axes, places, percent, style, name, handles)
    axes.axhline(1.0, color="0.5", linewidth=0.8, linestyle=":", zorder=0)
    axes.set_yscale("symlog", linthresh=0.1)
    axes.set_ylim(bottom=0)
    names = [f"{scenario}\n{speed}\nλ = {lam:g}" for speed, scenario, lam in measured]
    axes.set_xticks(range(len(measured)), names, fontsize=7)
    axes.set_ylabel("regret (% of the cost)", fontsize=8)
    axes.tick_params(axis="y", labelsize=7)
    axes.grid(axis="y", alpha=0.3)
    _finish(figure, handles, title)
    return figure


def _finish(figure: Figure, handles: dict[str, Any], title: str) -> None:
    """Add the legend and the title."""
    names = [name for name in PLAYERS if name in handles]
    figure.legend(
        [handles[name] for name in names], names, loc="outside lower center", ncols=3, fontsize=8
    )
    figure.suptitle(title, fontsize=10)
