"""Uniform grids over the states of an agent, of one or two components.

A grid always has two axes; the second one of an agent with one state component has one point.
The goal is a grid point, so that the faces of the arrival region keep their place in the cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env.env.arrival_regions import arrival_tolerances
from ppg_env.env.rules import Rules
from ppg_env.errors import InputError
from ppg_env.game.dynamics import square_root
from ppg_env.game.game import Game
from ppg_env.game.input_sets import bounds
from ppg_env.support.frozen import Record

AXES = 2
"""Axes of a grid."""

CELLS_PER_STEP = 4
"""Cells that an agent at full speed crosses per step, by default."""

ROOM = 3.0
"""Standard deviations of the noise of a step that a grid leaves at its border."""


@dataclass(frozen=True, eq=False)
class Grid(Record):
    """Points low + k step, k < shape, numbered with the second axis fastest.

    Attributes
    ----------
    low, step : (2,) first point and distance of points per axis.
    shape : number of points per axis.
    """

    low: np.ndarray
    step: np.ndarray
    shape: tuple[int, int]

    @property
    def size(self) -> int:
        """Number K of points."""
        return self.shape[0] * self.shape[1]

    @property
    def points(self) -> np.ndarray:
        """(K, 2) states at the points."""
        axes = [
            low + step * np.arange(n)
            for low, step, n in zip(self.low, self.step, self.shape, strict=True)
        ]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, AXES)

    def nearest(self, state: np.ndarray) -> np.ndarray:
        """Return the numbers of the points nearest to ``state`` (..., 2)."""
        index = np.rint((state - self.low) / self.step).astype(int)
        index = np.clip(index, 0, np.array(self.shape) - 1)
        return index[..., 0] * self.shape[1] + index[..., 1]


def padded(values: np.ndarray) -> np.ndarray:
    """Return ``values`` (..., n), n <= 2, with zeros up to two components."""
    short = AXES - values.shape[-1]
    return np.concatenate([values, np.zeros((*values.shape[:-1], short))], axis=-1)


def default_step(game: Game, agent: int, rules: Rules) -> float:
    """Return a quarter of the longest step per axis, at most half of the arrival tolerance.

    Where inputs do not move positions directly, it is half of the tolerance.
    """
    reach = _reach(game, agent)[: game.dim].max()
    widths = arrival_tolerances(game, rules.tolerance)[agent][: game.dim]
    candidates = [value for value in (reach / CELLS_PER_STEP, widths.min() / 2) if value > 0]
    if not candidates:
        raise InputError("step", "cannot be derived from speed and tolerance", "give a step")
    return float(min(candidates))


def make_grid(game: Game, agent: int, step: float) -> Grid:
    """Return the grid of ``agent`` with ``step`` between positions.

    It covers start and goal, with room on each side to pass by another body at full speed.
    """
    mover, d = game.agents[agent], game.dim
    n = mover.state_dim
    if n > AXES:
        raise InputError(
            f"agent[{agent}]",
            f"has {n} state components",
            "feedback policies are for games whose joint state has up to four dimensions",
        )
    noise = np.sqrt(np.diag(mover.noise))
    sizes, lows, shape = np.ones(AXES), np.zeros(AXES), [1, 1]
    margin = _bodies(game, agent)
    reach = _reach(game, agent)
    for k in range(n):
        goal = mover.goal[k] if k < mover.goal.size else 0.0
        if k < d:
            size, room = step, margin[k] + reach[k] / 2 + ROOM * noise[k]
        else:
            room = _velocity_room(game, agent, k) + ROOM * noise[k]
            size = reach[k] / CELLS_PER_STEP if reach[k] > 0 else step
        low, high = min(mover.start[k], goal) - room, max(mover.start[k], goal) + room
        below, above = np.ceil((goal - low) / size), np.ceil((high - goal) / size)
        sizes[k], lows[k], shape[k] = size, goal - below * size, int(below + above) + 1
    return Grid(lows, sizes, (shape[0], shape[1]))


def _reach(game: Game, agent: int) -> np.ndarray:
    """Return the largest change (n,) of a state component by the input of one step."""
    mover = game.agents[agent]
    low, high = bounds(mover.control)
    return np.abs(mover.B) @ np.maximum(np.abs(low), np.abs(high))


def _bodies(game: Game, agent: int) -> np.ndarray:
    """Return half the widths (d,) of the largest collision set of ``agent``."""
    widths = [
        np.abs(e.collision.vertices).max(axis=0)
        for e in game.encounters
        if agent in e.agents and e.obstacle is None
    ]
    return np.max([np.zeros(game.dim), *widths], axis=0)


def _velocity_room(game: Game, agent: int, component: int) -> float:
    """Return the room of a component that is no position: what inputs reach while accelerating."""
    mover = game.agents[agent]
    reach = _reach(game, agent)[component]
    extent = np.abs(mover.goal[: game.dim] - mover.start[: game.dim]).max()
    spread = float(np.abs(square_root(mover.noise)[component]).sum())
    return float(max(np.sqrt(max(extent, 1.0) * reach), 2 * reach, spread))
