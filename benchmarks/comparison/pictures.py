"""Pictures of ``compare`` and ``render``: paths, arrivals and crash probabilities.

Needs the extra ``render`` (matplotlib).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.comparison.report import game_name
from benchmarks.comparison.results import PlayerResult
from benchmarks.figures import new_figure, write_figure
from ppg_env.game.between_steps import overlap_times
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from ppg_env.plotting.bodies import COLOURS, as_drawn, draw_game
from ppg_env.plotting.episodes import draw_paths
from ppg_env.plotting.profiles import closest_approach, draw_profile

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEGEND_AGENTS = 6
"""With more agents the legend would leave no room for the bars."""

WIDTH, PANEL = 6.4, 3.3
ROOM, SIDE = 1.1, 0.8
SHORTEST, TALLEST, MOST_PANEL = 2.0, 9.0, 3.9
BELOW = 2.5
"""Inches: widths of a picture and of a panel of several; room for labels above and below, and at
the sides; limits of heights; height of the bars below the panels."""

IMPOSSIBLE = "#b00020"

LEGEND = (
    "star: goal   dots: mean at each step   dashed: 2-sigma noise   "
    "numbers: time   dark: closest approach"
)
LEGEND_COLUMNS = 3
"""More would be wider than two panels."""

PATHS_LEGEND = "star: goal   thin: episodes   thick: their mean   numbers: time"

PANELS = 4
"""Panels per line, at most."""

LEAST = 1e-30
"""Smallest crash probability on the axis."""


def profile_picture(game: Game, profile: Profile | None, path: str) -> None:
    """Write a PNG of a profile, or of the game alone; its height follows the game's.

    The title says what is not possible in the profile.
    """
    figure = new_figure(WIDTH, WIDTH)
    axes = figure.subplots()
    if profile is None:
        draw_game(axes, game)
        axes.set_title(as_drawn(game_name(game)))
    else:
        draw_profile(axes, game, profile)
        title = f"{as_drawn(game_name(game))}{_closest(game, profile)}"
        violations = evaluate(game, profile).violations()
        axes.set_title(
            "\n".join([title, *(f"not possible: {as_drawn(v)}" for v in violations[:2])]),
            fontsize=10,
            color=IMPOSSIBLE if violations else "black",
        )
    figure.set_size_inches(WIDTH, _height(axes, WIDTH, TALLEST))
    figure.supxlabel(LEGEND, fontsize=7)
    write_figure(figure, path)


def comparison_picture(game: Game, rows: Sequence[PlayerResult], path: str) -> None:
    """Write a PNG: one panel of paths per player, arrival times and crash probabilities below."""
    played = [row for row in rows if row.played is not None]
    lines = -(-len(played) // PANELS)
    wide = -(-len(played) // lines)
    figure = new_figure(max(PANEL * wide, 2 * PANEL), BELOW)
    grid = figure.add_gridspec(2, 1)
    top = grid[0].subgridspec(lines, wide)
    panels: list[Any] = []
    for k, row in enumerate(played):
        axes = figure.add_subplot(
            top[k // wide, k % wide],
            sharex=panels[0] if k else None,
            sharey=panels[0] if k else None,
        )
        _paths(axes, game, row)
        if k % wide:
            axes.set_ylabel("")
        panels.append(axes)
    tall = lines * max((_height(axes, PANEL, MOST_PANEL) for axes in panels), default=SHORTEST)
    figure.set_size_inches(figure.get_figwidth(), BELOW + tall)
    grid.set_height_ratios((tall, BELOW))
    bottom = grid[1].subgridspec(1, 2)
    _arrivals(figure.add_subplot(bottom[0]), game, played)
    _crashes(figure.add_subplot(bottom[1]), game, played)
    figure.suptitle(
        f"{as_drawn(game_name(game))}: objective {game.objective}, {_lams(game)}", fontsize=11
    )
    in_environment = any(row.played and row.played.paths is not None for row in played)
    figure.supxlabel(PATHS_LEGEND if in_environment else LEGEND, fontsize=7)
    write_figure(figure, path)


def _height(axes: Axes, width: float, tallest: float) -> float:
    """Return the height at which a panel of ``width`` with equal scales has no white margins."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    tall = ROOM + (width - SIDE) * (high - low) / (right - left)
    return float(np.clip(tall, SHORTEST, tallest))


def _paths(axes: Axes, game: Game, row: PlayerResult) -> None:
    """Draw the episodes in the environment, or the plans on schedule."""
    assert row.played is not None
    if row.played.paths is not None:
        draw_paths(axes, game, row.played.paths)
        axes.set_title(_short(row.player), fontsize=9)
        return
    assert row.profile is not None
    draw_profile(axes, game, row.profile)
    axes.set_title(f"{row.player}{_closest(game, row.profile)}", fontsize=9)


def _arrivals(axes: Axes, game: Game, rows: Sequence[PlayerResult]) -> None:
    count = len(game.agents)
    for i, name in enumerate(game.agent_names):
        places = np.arange(len(rows)) + (i - (count - 1) / 2) * 0.8 / count
        times = np.array([row.played.arrival[i] for row in rows if row.played])
        heights = np.where(np.isfinite(times), times, 0.0)  # no arrival: no bar
        axes.bar(
            places, heights, 0.8 / count, color=COLOURS[i % len(COLOURS)], label=as_drawn(name)
        )
    axes.set_xticks(range(len(rows)), _ticks(rows), fontsize=9 if len(rows) <= PANELS else 7)
    axes.set_ylabel("arrival (steps)")
    if 1 < count <= LEGEND_AGENTS:
        wide = min(count, LEGEND_COLUMNS)
        axes.legend(fontsize=7, ncols=wide, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def _crashes(axes: Axes, game: Game, rows: Sequence[PlayerResult]) -> None:
    """Draw crash probabilities on a log scale, with intervals over runs if there are several.

    An arrow points down from the upper limit if no crash was seen.
    """
    played = [row.played for row in rows if row.played is not None]
    estimates = [result.crash_any for result in played]
    for k, (result, estimate) in enumerate(zip(played, estimates, strict=True)):
        if estimate.value:
            runs = result.over_runs if result.method == "mc" else None
            limits = runs["crash_probability"] if runs else estimate
            low = max(limits.low, estimate.value / 100)  # a log scale has no zero
            error = np.array([[estimate.value - low], [limits.high - estimate.value]])
            axes.errorbar(k, estimate.value, yerr=error, fmt="o", color="black", capsize=5)
            label, height = f"{estimate.value:.1e}", estimate.value
        else:
            arrow = np.array([[0.6 * estimate.high], [0.0]])
            axes.errorbar(k, estimate.high, arrow, uplims=True, fmt="_", color="black", capsize=4)
            label, height = f"< {estimate.high:.0e}", estimate.high
        axes.annotate(label, (k, height), xytext=(8, -3), textcoords="offset points", fontsize=8)
    axes.set_yscale("log")
    lowest = min(estimate.low or 0.3 * estimate.high for estimate in estimates)
    axes.set_ylim(max(lowest / 3, LEAST), 2.0)
    axes.set_xlim(-0.5, len(rows) - 0.3)
    axes.set_xticks(range(len(rows)), _ticks(rows), fontsize=9 if len(rows) <= PANELS else 7)
    axes.set_ylabel(f"Pr(any overlap\n{overlap_times(game)})")
    axes.grid(axis="y", alpha=0.3)


def _short(player: str) -> str:
    """Return a player's name; that of a file without its folder."""
    return player.rsplit("/", 1)[-1].removesuffix(".npz")


def _ticks(rows: Sequence[PlayerResult]) -> list[str]:
    return [_short(row.player).replace("-", "-\n", 1) for row in rows]


def _closest(game: Game, profile: Profile) -> str:
    time = closest_approach(game, profile)
    return "" if time is None else f"   closest at t = {time}"


def _lams(game: Game) -> str:
    return "λ = " + ", ".join(f"{lam:g}" for lam in sorted({agent.lam for agent in game.agents}))
