"""Marks where means pass through something between two time steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ppg_env.game.between_steps import StepOverlap
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from ppg_env.plotting.bodies import draw_outline, plane

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CROSS = "#B00000"
"""Colour of overlaps between time steps, that of no agent."""


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
            draw_outline(axes, shape.vertices, position, CROSS, linestyle=":")
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
