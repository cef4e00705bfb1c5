"""Bodies, games and names on matplotlib axes.

The colours are the palette of Okabe and Ito, distinguishable by colour-blind readers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ppg_env.game.game import Game

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
MOVING = "0.45"
"""Grey of the paths and outlines of moving obstacles."""


def draw_game(axes: Axes, game: Game) -> None:
    """Draw the obstacles, and each agent's body at its start and marker at its goal.

    A moving obstacle is drawn at time 0, with its path dashed.
    """
    from matplotlib.patches import Polygon

    for obstacle in game.obstacles:
        axes.add_patch(Polygon(outline(obstacle.vertices_at(0)), color="0.75", zorder=0))
        if obstacle.path is not None:
            axes.plot(*plane(obstacle.path[: obstacle.until].T), "--", color=MOVING, zorder=1)
    for i, agent in enumerate(game.agents):
        colour = COLOURS[i % len(COLOURS)]
        draw_body(axes, agent.shape.vertices, agent.start[: game.dim], colour, 0.15)
        goal = agent.goal[: game.dim]
        axes.plot(
            *plane(goal),
            marker="*",
            markersize=11,
            color=colour,
            markeredgecolor="white",
            zorder=5,
        )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x (length)")
    axes.set_ylabel("y (length)")


def as_drawn(text: str) -> str:
    """Return ``text`` such that figures show it as it is: a dollar sign begins no formula."""
    return text.replace("$", r"\$")


def plane(points: np.ndarray) -> tuple[Any, Any]:
    """Return the first two coordinates; agents on a line are drawn on the x axis."""
    return (points[0], points[1]) if len(points) > 1 else (points[0], np.zeros_like(points[0]))


def outline(vertices: np.ndarray) -> np.ndarray:
    """Return the outline (V, 2) of a body; its projection on the first two axes in space."""
    if vertices.shape[1] == 2:
        return vertices
    if vertices.shape[1] == 1:
        low, high = vertices.min(), vertices.max()
        half = (high - low) / 8
        return np.array([[low, -half], [high, -half], [high, half], [low, half]])
    from scipy.spatial import ConvexHull

    projection = vertices[:, :2]
    return projection[ConvexHull(projection).vertices]


def draw_body(
    axes: Axes, vertices: np.ndarray, position: np.ndarray, colour: str, alpha: float
) -> None:
    """Draw a body at a position: its area in ``colour``, and its outline."""
    from matplotlib.patches import Polygon

    edge = outline(vertices) + np.array(plane(position))
    axes.add_patch(Polygon(edge, facecolor=colour, alpha=alpha, zorder=1))
    draw_outline(axes, vertices, position, colour)


def draw_outline(
    axes: Axes, vertices: np.ndarray, position: np.ndarray, colour: str, linestyle: str = "-"
) -> None:
    """Draw the outline of a body at a position."""
    from matplotlib.patches import Polygon

    edge = outline(vertices) + np.array(plane(position))
    wide = 0.7 if linestyle == "-" else 1.1
    patch = Polygon(edge, fill=False, edgecolor=colour, linewidth=wide, linestyle=linestyle)
    patch.set_zorder(2)
    axes.add_patch(patch)
