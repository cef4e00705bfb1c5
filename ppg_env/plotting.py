"""Figures of a game and a profile on matplotlib axes: bodies, paths, noise, arrivals.

The colours are the palette of Okabe and Ito, distinguishable by colour-blind readers.  Bodies are
drawn at a few times common to all agents, darkest at the closest approach.  A cross marks each
place where the means pass through something between two time steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ppg_env.game.between_steps import StepOverlap, overlaps_between_steps
from ppg_env.game.dynamics import covariances
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
ELLIPSE_DEVIATIONS = 2.0
BODY_TIMES = 4
MOVING = "0.45"
"""Grey of the paths and outlines of moving obstacles."""

CROSS = "#B00000"
"""Colour of overlaps between time steps, that of no agent."""


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
        _body(axes, agent.shape.vertices, agent.start[: game.dim], colour, 0.15)
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


def draw_profile(axes: Axes, game: Game, profile: Profile) -> None:
    """Draw the game and every agent's path, body and noise at a few times, and arrival."""
    draw_game(axes, game)
    closest = closest_approach(game, profile)
    last = [game.horizon if plan.arrival is None else plan.arrival for plan in profile]
    shared = np.unique(np.linspace(0, max(last), BODY_TIMES + 2).round().astype(int))[1:-1]
    _draw_moving_obstacles(axes, game, [t for t in {*shared.tolist(), closest} if t is not None])
    for i, (agent, plan) in enumerate(zip(game.agents, profile, strict=True)):
        colour, path = COLOURS[i % len(COLOURS)], plan.means[: last[i] + 1, : game.dim]
        axes.plot(*plane(path.T), color=colour, marker=".", markersize=4, linewidth=1.2, zorder=3)
        spread = covariances(agent, game.horizon)[:, : game.dim, : game.dim]
        for t in sorted({*shared.tolist(), closest} & set(range(last[i]))):
            _body(axes, agent.shape.vertices, path[t], colour, 0.45 if t == closest else 0.12)
            _ellipse(axes, path[t], spread[t], colour)
            axes.annotate(
                str(t), plane(path[t]), xytext=(2, 2), textcoords="offset points", fontsize=6
            )
        if plan.arrival is not None:
            axes.annotate(
                f"T = {plan.arrival}",
                plane(path[-1]),
                xytext=(0, 9),
                textcoords="offset points",
                color=colour,
                fontsize=8,
                ha="center",
                zorder=6,
                bbox={"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.5},
            )
    _mark_overlaps(axes, game, profile)
    axes.autoscale_view()


def _draw_moving_obstacles(axes: Axes, game: Game, times: Sequence[int]) -> None:
    """Draw the outlines of moving obstacles at ``times``, while they are there."""
    for obstacle in game.obstacles:
        if obstacle.path is None:
            continue
        for t in times:
            if obstacle.until is None or t < obstacle.until:
                where = obstacle.positions(game.horizon)[t]
                _outline(axes, obstacle.shape.vertices, where, MOVING)
                axes.annotate(
                    str(t), plane(where), xytext=(2, 2), textcoords="offset points", fontsize=6
                )


def _mark_overlaps(axes: Axes, game: Game, profile: Profile) -> None:
    """Mark where means pass through something between two time steps; the legend says when."""
    overlaps = overlaps_between_steps(game, profile)
    if overlaps:
        mark_overlaps(axes, game, profile, overlaps)


def overlap_label(overlaps: Sequence[StepOverlap]) -> str:
    """Return when the first of ``overlaps`` is and how deep, and the number of others."""
    first = overlaps[0]
    label = f"overlap between steps {first.step} and {first.step + 1}, by {first.depth:.3g}"
    return label if len(overlaps) == 1 else f"{label}\n(and {len(overlaps) - 1} more)"


def mark_overlaps(
    axes: Axes, game: Game, profile: Profile, overlaps: Sequence[StepOverlap]
) -> None:
    """Mark ``overlaps`` between steps by crosses, with a legend.

    The outlines of agents and moving obstacles at those moments are dotted.
    """
    for overlap in overlaps:
        bodies = [(game.agents[i].shape, profile[i].means[:, : game.dim]) for i in overlap.agents]
        if overlap.obstacle is not None:
            obstacle = game.obstacles[overlap.obstacle]
            if obstacle.path is not None:
                bodies.append((obstacle.shape, obstacle.positions(game.horizon)))
        for shape, path in bodies:
            start, end = path[overlap.step : overlap.step + 2]
            position = start + overlap.moment * (end - start)
            _outline(axes, shape.vertices, position, CROSS, linestyle=":")
    places = np.array([plane(np.array(overlap.place)) for overlap in overlaps])
    axes.plot(
        *places.T,
        linestyle="none",
        marker="X",
        markersize=10,
        color=CROSS,
        markeredgecolor="white",
        label=overlap_label(overlaps),
        zorder=7,
    )
    axes.legend(fontsize=6, loc="best", framealpha=0.6, handletextpad=0.2, borderpad=0.3)


def draw_paths(axes: Axes, game: Game, states: np.ndarray) -> None:
    """Draw the game and the paths of episodes.

    Thin lines are single episodes; thick lines, with bodies at a few times, are the means of the
    episodes still in traffic.

    Parameters
    ----------
    axes : the axes to draw on.
    game : the game.
    states : (episodes, T + 1, N, n) states, nan after an agent has left the game.
    """
    draw_game(axes, game)
    places = states[..., : game.dim]
    present = np.isfinite(places[..., 0])
    halfway = int(np.median(present.any(axis=2).sum(axis=1)) // 2)
    for i, agent in enumerate(game.agents):
        colour = COLOURS[i % len(COLOURS)]
        for path, valid in zip(places[:, :, i], present[:, :, i], strict=True):
            axes.plot(*plane(path[valid].T), color=colour, linewidth=0.4, alpha=0.4, zorder=2)
        last = int(np.median(present[:, :, i].sum(axis=1)))
        mean = np.nanmean(places[:, :last, i], axis=0)
        axes.plot(*plane(mean.T), color=colour, marker=".", markersize=4, linewidth=1.4, zorder=3)
        for t in {halfway // 2, halfway, halfway + halfway // 2} & set(range(last)):
            _body(axes, agent.shape.vertices, mean[t], colour, 0.3 if t == halfway else 0.12)
            axes.annotate(
                str(t), plane(mean[t]), xytext=(2, 2), textcoords="offset points", fontsize=6
            )
    axes.autoscale_view()


def closest_approach(game: Game, profile: Profile) -> int | None:
    """Return the time of the smallest margin in traffic, None if all margins are at the cap."""
    evaluation = evaluate(game, profile)
    margins = np.where(evaluation.traffic, evaluation.margins, np.inf)
    if not margins.size or margins.min() >= game.margin_cap:
        return None
    return int(np.unravel_index(margins.argmin(), margins.shape)[1])


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


def _body(
    axes: Axes, vertices: np.ndarray, position: np.ndarray, colour: str, alpha: float
) -> None:
    from matplotlib.patches import Polygon

    edge = outline(vertices) + np.array(plane(position))
    axes.add_patch(Polygon(edge, facecolor=colour, alpha=alpha, zorder=1))
    _outline(axes, vertices, position, colour)


def _outline(
    axes: Axes, vertices: np.ndarray, position: np.ndarray, colour: str, linestyle: str = "-"
) -> None:
    from matplotlib.patches import Polygon

    edge = outline(vertices) + np.array(plane(position))
    wide = 0.7 if linestyle == "-" else 1.1
    patch = Polygon(edge, fill=False, edgecolor=colour, linewidth=wide, linestyle=linestyle)
    patch.set_zorder(2)
    axes.add_patch(patch)


def _ellipse(axes: Axes, position: np.ndarray, covariance: np.ndarray, colour: str) -> None:
    from matplotlib.patches import Ellipse

    if len(position) < 2:
        return
    values, vectors = np.linalg.eigh(covariance[:2, :2])
    width, height = 2 * ELLIPSE_DEVIATIONS * np.sqrt(np.maximum(values, 0.0))
    angle = np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0]))
    axes.add_patch(
        Ellipse(
            plane(position),
            width,
            height,
            angle=angle,
            fill=False,
            edgecolor=colour,
            linestyle="--",
            linewidth=0.8,
            zorder=4,
        )
    )
