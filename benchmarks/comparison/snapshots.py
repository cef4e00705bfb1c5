"""Pictures of a plan at a few times: a panel each, with the bodies and the step that ends there.

Needs the extra ``render`` (matplotlib).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.comparison.report import game_name
from benchmarks.figures import new_figure, write_figure
from ppg_env.errors import require
from ppg_env.game.between_steps import overlaps_between_steps
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan, Profile
from ppg_env.game.workspace import workspace_limits, workspace_rows
from ppg_env.plotting import COLOURS, as_drawn, mark_overlaps, outline, overlap_label, plane

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
        _draw(axes, game, profile, time)
        during = [overlap for overlap in overlaps if overlap.step + 1 == time]
        if during:
            mark_overlaps(axes, game, profile, during)
    figure.suptitle(as_drawn(game_name(game)), fontsize=10)
    note = "\n" + overlap_label(overlaps).replace("\n", " ") if overlaps else ""
    figure.supxlabel(LEGEND + note, fontsize=7)
    write_figure(figure, path)


def _draw(axes: Axes, game: Game, profile: Profile, time: int) -> None:
    """Draw what is where at ``time``, and each body's step before."""
    from matplotlib.patches import Polygon

    for obstacle in game.obstacles:
        if obstacle.until is None or time < obstacle.until:
            axes.add_patch(Polygon(outline(obstacle.vertices_at(time)), color="0.75", zorder=0))
    for corners in _workspaces(axes, game):
        axes.add_patch(Polygon(corners, fill=False, edgecolor="0.5", linestyle=":", zorder=0))
    for i, (agent, plan) in enumerate(zip(game.agents, profile, strict=True)):
        colour = COLOURS[i % len(COLOURS)]
        goal = agent.goal[: game.dim]
        axes.plot(
            *plane(goal), marker="*", markersize=8, color=colour, markeredgecolor="white", zorder=5
        )
        if game.on_goal == "remove" and time > _end(plan, game):
            continue
        path = plan.means[: min(time, _end(plan, game)) + 1, : game.dim]
        axes.plot(*plane(path.T), color=colour, linewidth=0.9, marker=".", markersize=3, zorder=3)
        body = outline(agent.shape.vertices)
        axes.add_patch(Polygon(_hull(body, path[-2:]), facecolor=colour, alpha=0.25, zorder=1))
        axes.add_patch(Polygon(body + path[-1], facecolor=colour, alpha=0.8, zorder=2))


def _end(plan: Plan, game: Game) -> int:
    return game.horizon if plan.arrival is None else plan.arrival


def _hull(body: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the outline of all that ``body`` touches on the straight line between ``ends``."""
    from scipy.spatial import ConvexHull

    points = (ends[:, None] + body).reshape(-1, 2)
    hull: np.ndarray = points[ConvexHull(points).vertices]
    return hull


def _view(game: Game, profile: Profile) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corner of what is drawn: bodies at all times, obstacles near."""
    moved = [
        (plan.means[: _end(plan, game) + 1, None, :2] + outline(agent.shape.vertices)).reshape(
            -1, 2
        )
        for agent, plan in zip(game.agents, profile, strict=True)
    ]
    points = np.concatenate(moved)
    low, high = points.min(axis=0), points.max(axis=0)
    border = BORDER * float((high - low).max())
    return low - border, high + border


def _workspaces(axes: Axes, game: Game) -> list[np.ndarray]:
    """Return the outlines, within the axes, of the sets in which positions stay at time 0."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    distinct: dict[bytes, np.ndarray] = {}
    for agent in game.agents:
        rows, limits = workspace_rows(agent), workspace_limits(agent, game.horizon)[0]
        placed = ~rows[:, game.dim :].any(axis=1)
        corners = np.array([[left, bottom], [right, bottom], [right, top], [left, top]])
        for normal, limit in zip(rows[placed, : game.dim], limits[placed], strict=True):
            corners = _clipped(corners, normal, limit)
        if placed.any() and len(corners) > 2:
            distinct.setdefault(corners.tobytes(), corners)
    return list(distinct.values())


def _clipped(corners: np.ndarray, normal: np.ndarray, limit: float) -> np.ndarray:
    """Return the part of a convex polygon where ``normal`` x <= ``limit``."""
    kept = []
    excess = corners @ normal - limit
    for k, (here, over) in enumerate(zip(corners, excess, strict=True)):
        before, was = corners[k - 1], excess[k - 1]
        if (over > 0) != (was > 0):
            kept.append(before + (here - before) * was / (was - over))
        if over <= 0:
            kept.append(here)
    return np.array(kept).reshape(-1, 2)
