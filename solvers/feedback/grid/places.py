"""Places at which an agent can be parked: points of its grid in and next to its arrival region."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env.env.arrival_regions import checked_tolerances
from solvers.feedback.grid.joint_model import JointModel
from solvers.feedback.grid.state_grid import AXES, Grid

BORDER = 2
"""Cells next to the region that cubic interpolation reads."""


@dataclass(frozen=True)
class Places:
    """Points of an agent's grid at which it may be parked.

    Attributes
    ----------
    grid : the points as a grid.
    index : (P,) their numbers on the agent's grid.
    """

    grid: Grid
    index: np.ndarray

    def spread(self, values: np.ndarray, size: int) -> np.ndarray:
        """Return ``values`` (P, K) as (size, K), zero at all other points of the agent's grid."""
        result = np.zeros((size, values.shape[1]), dtype=np.float32)
        result[self.index] = values
        return result


def make_places(model: JointModel, agent: int) -> Places:
    """Return the places of ``agent``."""
    grid, goal = model.grids[agent], model.game.agents[agent].goal
    tolerance = checked_tolerances(model.game, model.rules)[agent]
    low, first, shape = grid.low.copy(), [0] * AXES, list(grid.shape)
    for k in range(goal.size):
        centre = round((goal[k] - grid.low[k]) / grid.step[k])
        room = int(np.floor(tolerance[k] / grid.step[k] + 1e-9)) + BORDER
        first[k] = max(centre - room, 0)
        shape[k] = min(centre + room, grid.shape[k] - 1) - first[k] + 1
        low[k] += first[k] * grid.step[k]
    rows, columns = (first[k] + np.arange(shape[k]) for k in range(AXES))
    index = (rows[:, None] * grid.shape[1] + columns[None]).ravel()
    return Places(Grid(low, grid.step, (shape[0], shape[1])), index)
