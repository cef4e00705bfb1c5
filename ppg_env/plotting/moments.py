"""One moment of a plan on matplotlib axes: where the bodies are, and the step before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.plan import Plan, Profile
from ppg_env.game.workspace import workspace_limits, workspace_rows
from ppg_env.plotting.bodies import COLOURS, outline, plane

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_moment(axes: Axes, game: Game, profile: Profile, time: int) -> None:
    """Draw what is where at ``time``: bodies dark, all that they touched in the step before pale.

    The dotted line bounds the positions of centres (``within``), inside the limits of the axes.
    """
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
        if game.on_goal == "remove" and time > last_step(plan, game):
            continue
        path = plan.means[: min(time, last_step(plan, game)) + 1, : game.dim]
        axes.plot(*plane(path.T), color=colour, linewidth=0.9, marker=".", markersize=3, zorder=3)
        body = outline(agent.shape.vertices)
        axes.add_patch(Polygon(_hull(body, path[-2:]), facecolor=colour, alpha=0.25, zorder=1))
        axes.add_patch(Polygon(body + path[-1], facecolor=colour, alpha=0.8, zorder=2))


def last_step(plan: Plan, game: Game) -> int:
    """Return the time of arrival, the horizon without."""
    return game.horizon if plan.arrival is None else plan.arrival


def _hull(body: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the outline of all that ``body`` touches on the straight line between ``ends``."""
    from scipy.spatial import ConvexHull

    points = (ends[:, None] + body).reshape(-1, 2)
    hull: np.ndarray = points[ConvexHull(points).vertices]
    return hull


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
