"""The actions that dynamic programming tries, and where they lead on a grid.

The actions are a lattice in the control set, aligned with the grid where the dynamics allow it, the
set's corners, and the middles of its edges that no other point of the lattice is on.  An action at
grid point x leads to y = A x + B u, before the noise; values at y are sums over a stencil of 16
points, or of one if all y are grid points.  States outside the grid count as on its border.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numba import prange

from ppg_env.env.projection import project_on_faces
from ppg_env.game.agent import Agent
from ppg_env.game.input_sets import bounds
from ppg_env.game.polytope import Polytope
from ppg_env.support.compilation import njit
from solvers.feedback.grid.cubic import keys_weights
from solvers.feedback.grid.state_grid import AXES, Grid, padded

STENCIL = 16
"""Points that cubic convolution takes in two dimensions."""

ON_POINT = 1e-6
"""A state this close to a grid point, in cells, is on it."""


@dataclass(frozen=True)
class Moves:
    """What an agent can do at each point of its grid.

    Attributes
    ----------
    actions : (A, m) inputs.
    cost : (A,) float32 effort of each.
    index : (K, A, S) grid points of the stencil of y, S = 1 or 16.
    weight : (K, A, S) float32 weights of these points.
    ends : (K, A, 2) float32 states y.
    window : (K, 4) first and last row, first and last column of the points of all stencils.
    """

    actions: np.ndarray
    cost: np.ndarray
    index: np.ndarray
    weight: np.ndarray
    ends: np.ndarray
    window: np.ndarray

    @property
    def aligned(self) -> bool:
        """Whether every move ends on a grid point."""
        return self.index.shape[2] == 1

    def at(self, values: np.ndarray) -> np.ndarray:
        """Return ``values`` (K,) of grid points at the states after each move, (K, A)."""
        return np.einsum("kas,kas->ka", self.weight, values[self.index])


def make_moves(mover: Agent, grid: Grid, control: Polytope) -> Moves:
    """Return the moves of ``mover`` with inputs in ``control``."""
    actions = action_set(mover, grid, control)
    ends = after(mover, grid.points[:, None], actions[None])
    index, weight = stencils(grid, ends.reshape(-1, AXES))
    shape = (grid.size, len(actions), -1)
    cost = (mover.effort * np.abs(actions).sum(axis=1)).astype(np.float32)
    index, weight = index.reshape(shape), weight.reshape(shape)
    rows, columns = np.divmod(index.reshape(grid.size, -1), grid.shape[1])
    edges = [f(part, axis=1) for part in (rows, columns) for f in (np.min, np.max)]
    window = np.stack(edges, axis=1).astype(np.int64)
    return Moves(actions, cost, index, weight, ends.astype(np.float32), window)


def after(mover: Agent, states: np.ndarray, actions: np.ndarray) -> np.ndarray:
    """Return A x + B u (..., axes) for states (..., n) and inputs (..., m)."""
    moved = states[..., : mover.state_dim] @ mover.A.T
    return padded(moved + actions @ mover.B.T, max(AXES, states.shape[-1]))


def longest_move(mover: Agent, grid: Grid) -> np.ndarray:
    """Return the largest change (axes,) of each state component in a step without noise."""
    last = grid.low + grid.step * (np.array(grid.shape) - 1)
    corners = np.array(list(product(*zip(grid.low, last, strict=True))))
    drift = after(mover, corners, np.zeros((1, mover.control_dim))) - corners
    low, high = bounds(mover.control)
    push = np.abs(mover.B) @ np.maximum(np.abs(low), np.abs(high))
    return np.abs(drift).max(axis=0) + padded(push, len(grid.shape))


def action_set(mover: Agent, grid: Grid, control: Polytope) -> np.ndarray:
    """Return the actions (A, m) in ``control``; shortest first."""
    low, high = control.bounds
    spacing = np.array([_spacing(mover, grid, j) for j in range(control.dim)])
    counts = [
        np.arange(np.ceil(a / s - 1e-9), np.floor(b / s + 1e-9) + 1) * s if b > a else np.array([a])
        for a, b, s in zip(low, high, spacing, strict=True)
    ]
    lattice = np.array(list(product(*counts)))
    lattice = lattice[control.clearance(lattice) <= 1e-9]
    corners = control.vertices
    middles = (corners + np.roll(corners, -1, axis=0)) / 2 if control.dim == 2 else corners[:0]
    inside = _on_faces(lattice, control)
    touched = inside[inside.sum(axis=1) == 1].any(axis=0)
    middles = middles[~(_on_faces(middles, control) & touched).any(axis=1)]
    every = np.concatenate(
        [lattice, corners, middles, project(np.zeros_like(corners[:1]), control)]
    )
    every = np.unique(np.round(every, 9) + 0.0, axis=0)
    return every[np.argsort(np.abs(every).sum(axis=1), kind="stable")]


def _on_faces(points: np.ndarray, control: Polytope) -> np.ndarray:
    """Return (P, F) whether each of ``points`` is on each face of ``control``."""
    return np.abs(points @ control.normals.T - control.offsets) <= 1e-9


def action_spacing(actions: np.ndarray, control: Polytope) -> np.ndarray:
    """Return (m,) the largest distance between neighbouring ``actions``, per component."""
    low, high = control.bounds
    lattice = [np.unique(np.abs(column).round(9)) for column in actions.T]
    gaps = [
        np.diff(values).max() if values.size > 1 else high[q] - low[q]
        for q, values in enumerate(lattice)
    ]
    return np.array(gaps)


def _spacing(mover: Agent, grid: Grid, component: int) -> float:
    column = np.abs(mover.B[:, component])
    steps = [grid.step[k] / column[k] for k in range(len(column)) if column[k] > 0]
    return float(min(steps, default=np.inf))


def stencils(grid: Grid, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return grid points (M, S) and weights (M, S) whose sums are the values at ``states``."""
    shape = np.array(grid.shape)
    place = np.clip((states - grid.low) / grid.step, 0, shape - 1)
    nearest = np.rint(place)
    if np.abs(place - nearest).max() < ON_POINT:
        index = nearest[:, 0] * shape[1] + nearest[:, 1]
        return index.astype(np.int32)[:, None], np.ones((len(states), 1), dtype=np.float32)
    index = np.empty((len(states), STENCIL), dtype=np.int32)
    weight = np.empty((len(states), STENCIL), dtype=np.float32)
    _stencils(place, grid.shape, index, weight)
    return index, weight


def project(actions: np.ndarray, control: Polytope) -> np.ndarray:
    """Return the points of ``control`` nearest to ``actions`` (C, m)."""
    low, high = control.bounds
    if control.kind == "box" or control.dim == 1:
        return np.clip(actions, low, high)
    result = np.array(actions, dtype=float)
    _project(control.normals, control.offsets, result)
    return result


@njit(cache=True)
def _project(normals, offsets, actions):
    for c in range(actions.shape[0]):
        project_on_faces(normals, offsets, 0, offsets.size, actions[c])


@njit(cache=True, parallel=True)
def _stencils(place, shape, index, weight):
    for p in prange(place.shape[0]):
        w0, w1 = np.empty(4), np.empty(4)
        i = min(int(place[p, 0]), max(shape[0] - 2, 0))
        j = min(int(place[p, 1]), max(shape[1] - 2, 0))
        keys_weights(place[p, 0] - i, w0)
        keys_weights(place[p, 1] - j, w1)
        for r in range(4):
            row = min(max(i + r - 1, 0), shape[0] - 1) * shape[1]
            for s in range(4):
                index[p, 4 * r + s] = row + min(max(j + s - 1, 0), shape[1] - 1)
                weight[p, 4 * r + s] = w0[r] * w1[s]
