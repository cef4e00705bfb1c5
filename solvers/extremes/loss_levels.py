"""Piecewise bounds on the loss as a function of the margin: tangents below, steps above."""

from __future__ import annotations

import numpy as np

from ppg_env.game import objective
from ppg_env.game.game import Game

STEPS = (1.0, 0.1, 0.01)
"""Losses between which those of risk are not distinguished from above, in time steps."""

POINTS = 12
"""Tangents of the risk from below."""


def tangents(game: Game) -> list[tuple[float, float]]:
    """Return slopes and intercepts of lines below the loss."""
    points = np.zeros(1)
    if game.objective == "risk":
        points = game.margin_cap * np.linspace(0, 1, POINTS, endpoint=False) ** 1.4
    slopes, losses = objective.loss_slope(game, points), objective.loss(game, points)
    return list(zip(slopes.tolist(), (losses - slopes * points).tolist(), strict=True))


def levels(game: Game) -> list[tuple[float, float]]:
    """Return margins and their losses, at which steps above the loss of risk end; the cap last."""
    from scipy.special import erfcinv

    cost = game.crash_cost
    wanted = np.array([loss for loss in STEPS if loss < cost / 2])
    margins = erfcinv(2 * wanted / cost) if cost > 0 else np.zeros(0)
    margins = np.append(margins[margins < game.margin_cap], game.margin_cap)
    return list(zip(margins.tolist(), objective.loss(game, margins).tolist(), strict=True))
