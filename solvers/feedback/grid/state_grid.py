"""Uniform grids over the states of an agent.

A grid of one of two agents always has two axes, that of an agent without others four; those beyond
the components of the state have one point.
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
from ppg_env.game.obstacle import Obstacle
from ppg_env.support.frozen import Record

AXES, MOST_AXES = 2, 4
"""Axes of the grid of one of two agents, and of an agent without others."""

CELLS_PER_STEP, COARSE_CELLS = 4, 2
"""Cells that an input of full size crosses per step: by default, and of the velocities of an agent
without others."""

ROOM = 3.0
"""Standard deviations of the noise of a step that a grid leaves at its border."""


@dataclass(frozen=True, eq=False)
class Grid(Record):
    """Points low + k step, k < shape, numbered with the last axis fastest.

    Attributes
    ----------
    low, step : (axes,) first point and distance of points per axis.
    shape : number of points per axis.
    """

    low: np.ndarray
    step: np.ndarray
    shape: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number K of points."""
        return int(np.prod(self.shape))

    @property
    def points(self) -> np.ndarray:
        """(K, axes) states at the points."""
        axes = [
            low + step * np.arange(n)
            for low, step, n in zip(self.low, self.step, self.shape, strict=True)
        ]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(self.shape))

    def nearest(self, state: np.ndarray) -> np.ndarray:
        """Return the numbers of the points nearest to ``state`` (..., 2)."""
        index = np.rint((state - self.low) / self.step).astype(int)
        index = np.clip(index, 0, np.array(self.shape) - 1)
        return index[..., 0] * self.shape[1] + index[..., 1]


def padded(values: np.ndarray, axes: int = AXES) -> np.ndarray:
    """Return ``values`` (..., n), n <= axes, with zeros up to ``axes`` components."""
    short = axes - values.shape[-1]
    return np.concatenate([values, np.zeros((*values.shape[:-1], short))], axis=-1)


def default_step(game: Game, agent: int, rules: Rules) -> float:
    """Return a quarter of the longest step per axis, at most half of the arrival tolerance.

    Where velocities move positions, it is half of the tolerance.
    """
    mover, d = game.agents[agent], game.dim
    reach = _reach(game, agent)[:d].max()
    if not np.array_equal(mover.A[:d], np.eye(mover.state_dim)[:d]):
        reach = 0.0
    widths = arrival_tolerances(game, rules.tolerance)[agent][:d]
    candidates = [value for value in (reach / CELLS_PER_STEP, widths.min() / 2) if value > 0]
    if not candidates:
        raise InputError("step", "cannot be derived from speed and tolerance", "give a step")
    return float(min(candidates))


def make_grid(game: Game, agent: int, step: float, axes: int = AXES) -> Grid:
    """Return the grid of ``agent`` with ``step`` between positions.

    It covers start and goal, with room on each side to pass by another body at full speed; with
    more than two ``axes`` also the obstacles next to it.
    """
    mover, d = game.agents[agent], game.dim
    n = mover.state_dim
    if n > axes:
        raise InputError(
            f"agent[{agent}]",
            f"has {n} state components",
            "feedback policies are for games whose joint state has up to four dimensions",
        )
    goal = np.zeros(n)
    goal[: mover.goal.size] = mover.goal
    room, reach = _room(game, agent), _reach(game, agent)
    low, high = np.minimum(mover.start, goal) - room, np.maximum(mover.start, goal) + room
    cells = CELLS_PER_STEP if axes == AXES else COARSE_CELLS
    if axes > AXES:
        low[:d], high[:d] = _around_obstacles(game, agent, low[:d], high[:d], room[:d])
    sizes, lows, shape = np.ones(axes), np.zeros(axes), [1] * axes
    for k in range(n):
        size = step if k < d or reach[k] == 0 else reach[k] / cells
        below, above = np.ceil((goal[k] - low[k]) / size), np.ceil((high[k] - goal[k]) / size)
        sizes[k], lows[k], shape[k] = size, goal[k] - below * size, int(below + above) + 1
    return Grid(lows, sizes, tuple(shape))


def _room(game: Game, agent: int) -> np.ndarray:
    """Return the room (n,) of a grid beyond start and goal."""
    mover, d = game.agents[agent], game.dim
    room = np.empty(mover.state_dim)
    room[:d] = _bodies(game, agent) + _reach(game, agent)[:d] / 2
    for k in range(d, mover.state_dim):
        room[k] = _velocity_room(game, agent, k)
    room[:d] += np.abs(mover.A[:d, d:]) @ room[d:] / 2
    return np.asarray(room + ROOM * np.sqrt(np.diag(mover.noise)))


def _around_obstacles(
    game: Game, agent: int, low: np.ndarray, high: np.ndarray, room: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the box (d,), (d,) of positions, widened to pass obstacles it meets with ``room``."""
    boxes = [
        np.stack(e.collision.bounds) + place
        for e in game.encounters
        if e.obstacle is not None and e.agents[0] == agent
        for place in _places(game.obstacles[e.obstacle])
    ]
    met = [box for box in boxes if (box[0] < high).all() and (box[1] > low).all()]
    return (
        np.min([low, *(box[0] - room for box in met)], axis=0),
        np.max([high, *(box[1] + room for box in met)], axis=0),
    )


def _places(obstacle: Obstacle) -> np.ndarray:
    """Return (P, d) the positions of an obstacle over time."""
    return np.zeros((1, obstacle.dim)) if obstacle.path is None else obstacle.path


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
