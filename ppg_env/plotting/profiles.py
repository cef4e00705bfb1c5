"""A profile on matplotlib axes: bodies, paths, noise, arrivals.

Bodies are
drawn at a few times common to all agents, darkest at the closest approach.  A cross marks each
place where the means pass through something between two time steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ppg_env.game.between_steps import overlaps_between_steps
from ppg_env.game.dynamics import covariances
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from ppg_env.plotting.bodies import (
    COLOURS,
    MOVING,
    draw_body,
    draw_game,
    draw_outline,
    plane,
)
from ppg_env.plotting.overlaps import mark_overlaps

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ELLIPSE_DEVIATIONS = 2.0
BODY_TIMES = 4


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
            draw_body(axes, agent.shape.vertices, path[t], colour, 0.45 if t == closest else 0.12)
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
                draw_outline(axes, obstacle.shape.vertices, where, MOVING)
                axes.annotate(
                    str(t), plane(where), xytext=(2, 2), textcoords="offset points", fontsize=6
                )


def _mark_overlaps(axes: Axes, game: Game, profile: Profile) -> None:
    """Mark where means pass through something between two time steps; the legend says when."""
    overlaps = overlaps_between_steps(game, profile)
    if overlaps:
        mark_overlaps(axes, game, profile, overlaps)


def closest_approach(game: Game, profile: Profile) -> int | None:
    """Return the time of the smallest margin in traffic, None if all margins are at the cap."""
    evaluation = evaluate(game, profile)
    margins = np.where(evaluation.traffic, evaluation.margins, np.inf)
    if not margins.size or margins.min() >= game.margin_cap:
        return None
    return int(np.unravel_index(margins.argmin(), margins.shape)[1])


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
