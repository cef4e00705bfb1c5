"""Paths of simulated episodes on matplotlib axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ppg_env.game.game import Game
from ppg_env.plotting.bodies import COLOURS, draw_body, draw_game, plane

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
            draw_body(axes, agent.shape.vertices, mean[t], colour, 0.3 if t == halfway else 0.12)
            axes.annotate(
                str(t), plane(mean[t]), xytext=(2, 2), textcoords="offset points", fontsize=6
            )
    axes.autoscale_view()
