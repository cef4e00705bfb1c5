"""Compiled: what states outside the grid cost."""

from __future__ import annotations

from ppg_env.support.compilation import njit


@njit(cache=True, inline="always")
def way_back(body, y):
    """Return the cost of the way from ``y`` to the grid, zero inside.

    Values outside are those of the border: without this cost nothing leads back.
    """
    cost = 0.0
    for k in range(y.size):
        beyond = max(body.low[k] - y[k], y[k] - body.low[k] - body.step[k] * (body.shape[k] - 1))
        cost += body.back[k] * max(beyond, 0.0)
    return cost
