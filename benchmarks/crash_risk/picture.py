"""A picture of the likeliest crash: nominal bodies pale, the path to the crash dark.

Needs the extra ``render`` (matplotlib).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from benchmarks.crash_risk.explanation import Explanation
from benchmarks.figures import new_figure, write_figure
from ppg_env.plotting import COLOURS, draw_game
from ppg_env.plotting.bodies import as_drawn, outline, plane

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, ROOM, LEAST, MOST = 6.4, 1.1, 2.4, 9.0
"""Inches: the width; room for the texts above and below; limits of the height."""

BODIES = 5
"""Bodies along each path."""

PALE, DARK = 0.12, 0.55
LEGEND = "pale, dashed: the means   dark: the likeliest path to a crash   cross: reference points"


def crash_picture(explanation: Explanation, path: str) -> None:
    """Write a picture of the likeliest crash, or of the plan alone if there is none."""
    figure = new_figure(WIDTH, WIDTH)
    axes = figure.subplots()
    draw_game(axes, explanation.game)
    crash = explanation.crash
    for i, plan in enumerate(explanation.profile):
        own = i in explanation.game.encounters[crash.encounter].agents if crash else False
        last = explanation.game.horizon if plan.arrival is None else plan.arrival
        _draw_path(axes, explanation, i, plan.means[: last + 1], dark=False)
        if crash is not None and own:
            means = plan.means[: crash.time + 1] + crash.deviations[i]
            _draw_path(axes, explanation, i, means, dark=True)
    if crash is not None:
        _draw_obstacle(axes, explanation)
    axes.set_title(as_drawn(explanation.sentence()), fontsize=7)
    figure.supxlabel(LEGEND, fontsize=7)
    axes.autoscale_view()
    across, up = (abs(high - low) for low, high in (axes.get_xlim(), axes.get_ylim()))
    figure.set_size_inches(WIDTH, min(max(WIDTH * up / across + ROOM, LEAST), MOST))
    write_figure(figure, path)


def _draw_path(
    axes: Axes, explanation: Explanation, i: int, states: np.ndarray, *, dark: bool
) -> None:
    """Draw a path with bodies; the dark one ends in the crash, between two times if swept."""
    crash, d = explanation.crash, explanation.game.dim
    points, colour = states[:, :d], COLOURS[i % len(COLOURS)]
    if dark and crash is not None:
        points = _until(points, crash.share)
    axes.plot(
        *plane(points.T),
        linestyle="-" if dark else "--",
        color=colour,
        marker=".",
        markersize=4,
        linewidth=1.4 if dark else 0.8,
        alpha=1.0 if dark else 0.5,
        zorder=4 if dark else 2,
    )
    shown = np.unique(np.linspace(0, len(points) - 1, BODIES).round().astype(int))
    vertices = explanation.game.agents[i].shape.vertices
    for t in [len(points) - 1] if dark else shown:
        _body(axes, vertices, points[t], colour, DARK if dark else PALE)
    if dark:
        axes.plot(*plane(points[-1]), marker="x", color="black", zorder=6)


def _draw_obstacle(axes: Axes, explanation: Explanation) -> None:
    """Draw a moving obstacle where the crash finds it."""
    crash, game = explanation.crash, explanation.game
    assert crash is not None
    k = game.encounters[crash.encounter].obstacle
    if k is None or game.obstacles[k].path is None:
        return
    points = game.obstacles[k].positions(game.horizon)[: crash.time + 1]
    if crash.obstacle is not None:
        points = points + crash.obstacle
    _body(axes, game.obstacles[k].shape.vertices, _until(points, crash.share)[-1], "0.45", DARK)


def _until(points: np.ndarray, share: float) -> np.ndarray:
    """Return the points with the last one moved back to ``share`` of its step."""
    if len(points) < 2 or share >= 1.0:
        return points
    return np.vstack([points[:-1], (1 - share) * points[-2] + share * points[-1]])


def _body(axes: Axes, vertices: np.ndarray, place: np.ndarray, colour: str, alpha: float) -> None:
    from matplotlib.patches import Polygon

    edge = outline(vertices) + np.array(plane(place))
    axes.add_patch(Polygon(edge, facecolor=colour, edgecolor=colour, alpha=alpha, zorder=3))
