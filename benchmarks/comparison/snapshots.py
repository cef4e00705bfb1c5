"""Pictures of a plan at a few times: a panel each, with the bodies and the step that ends there.

Needs the extra ``render`` (matplotlib).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.comparison.report import game_name
from benchmarks.figures import new_figure, write_figure
from ppg_env.errors import require
from ppg_env.game.between_steps import overlaps_between_steps
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from ppg_env.plotting.bodies import as_drawn, outline
from ppg_env.plotting.moments import draw_moment, last_step
from ppg_env.plotting.overlaps import mark_overlaps, overlap_label

LEGEND = "star: goal   dark: body at t   pale: the step before   dotted: within, of the centre"

WIDE = 4.0
"""Panels of this ratio of width to height are stacked."""

FEW = 4
"""Up to so many panels, of up to so many agents, are in one line; others are in two columns."""

BORDER = 0.04
"""Free border, as a share of the larger side of the view."""


def snapshots_picture(game: Game, profile: Profile, times: Sequence[int], path: str) -> None:
    """Write a PNG with a panel for each of ``times``.

    Crosses mark where means pass through something during the step that ends at the time of a
    panel; a line below the panels states the deepest such overlap of the plan.

    Raises
    ------
    InputError
        If a time is outside the horizon, the game is not in two dimensions, or the file cannot be
        written.
    """
    require(game.dim == 2, "--times", "is for games in two dimensions", "leave it out")
    beyond = [time for time in times if not 0 <= time <= game.horizon]
    require(
        not beyond,
        "--times",
        f"has {beyond[:1]}",
        f"give times from 0 to {game.horizon}, as in 2,5",
    )
    overlaps = overlaps_between_steps(game, profile)
    low, high = _view(game, profile)
    wide, tall = high - low
    columns = 1 if wide > WIDE * tall else len(times) if max(len(times), len(profile)) <= FEW else 2
    lines = -(-len(times) // columns)
    across = max(7.5, 2.6 * columns)
    figure = new_figure(across, 0.5 + lines * (0.45 + 0.93 * across / columns * tall / wide))
    grid: Any = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for axes in grid.flat[len(times) :]:
        axes.set_visible(False)
    for axes, time in zip(grid.flat, times, strict=False):
        axes.set_title(f"t = {time}", fontsize=9, pad=3)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")
        axes.tick_params(labelsize=7)
        draw_moment(axes, game, profile, time)
        during = [overlap for overlap in overlaps if overlap.step + 1 == time]
        if during:
            mark_overlaps(axes, game, profile, during)
    figure.suptitle(as_drawn(game_name(game)), fontsize=10)
    note = "\n" + overlap_label(overlaps).replace("\n", " ") if overlaps else ""
    figure.supxlabel(LEGEND + note, fontsize=7)
    write_figure(figure, path)


def _view(game: Game, profile: Profile) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corner of what is drawn: bodies at all times, obstacles near."""
    moved = [
        (plan.means[: last_step(plan, game) + 1, None, :2] + outline(agent.shape.vertices)).reshape(
            -1, 2
        )
        for agent, plan in zip(game.agents, profile, strict=True)
    ]
    points = np.concatenate(moved)
    low, high = points.min(axis=0), points.max(axis=0)
    border = BORDER * float((high - low).max())
    return low - border, high + border
