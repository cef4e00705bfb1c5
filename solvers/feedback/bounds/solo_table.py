r"""The problem of one agent alone as tables on a grid, see :mod:`.solo_grid`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.input_sets import pieces
from ppg_env.game.polytope import Polytope
from solvers.feedback.bounds.gaussian_axis import Axis, NoAxis
from solvers.feedback.bounds.grid_rim import FAR, SoloProblem
from solvers.feedback.bounds.solo_grid import SoloGrid

NODES_PER_DEVIATION = 4.0
"""Nodes of the grid per standard deviation of one step's noise."""

MOST_NODES = 1_000_000
"""Largest number of nodes; beyond it the grid is coarser, and the bound lower."""


class SoloTable(NamedTuple):
    """Values of some components of an agent alone, in units of the cost of a step.

    Attributes
    ----------
    bound : the lower bound from the agent's start.
    axes : the grid.
    value : node values; their bilinear interpolant bounds the cost to go.
    """

    bound: float
    axes: tuple[Axis, Axis | NoAxis]
    value: np.ndarray


def solo_table(
    agent: Agent,
    block: tuple[int, ...],
    steps: int,
    tolerance: np.ndarray,
    *,
    leave: float,
    cover: tuple[tuple[float, float], ...] = (),
) -> SoloTable:
    """Return the table of a ``block`` of components with ``steps`` to go.

    ``leave`` is the cost of leaving at once; ``cover`` are lowest and highest positions of
    interest other than those on the way.
    """
    chosen = list(block)
    controls = [(first, control) for first, control in pieces(agent.control) if first < steps]
    moves = tuple((first, image(agent.B[chosen], control)) for first, control in controls)
    A = np.zeros((2, 2))
    A[: len(block), : len(block)] = agent.A[np.ix_(chosen, chosen)]
    effort = agent.effort / agent.lam
    unit = leave / agent.lam
    if agent.effort == 0:
        unit = min(unit, float(steps))
    return _table(
        tuple(map(tuple, A)),
        tuple((first, tuple(map(tuple, corners))) for first, corners in moves),
        tuple(map(tuple, _slopes(agent.B[chosen], effort))),
        tuple(agent.start[chosen]),
        tuple(np.sqrt(np.diag(agent.sigma0)[chosen])),
        tuple(agent.goal[k] if k < agent.goal.size else None for k in block),
        tuple(np.sqrt(np.diag(agent.noise)[chosen])),
        tuple(tolerance[k] if k < agent.goal.size else 0.0 for k in block),
        unit,
        steps,
        cover,
    )


@lru_cache(maxsize=16)
def _table(
    A: tuple[tuple[float, ...], ...],
    moves: tuple[tuple[int, tuple[tuple[float, ...], ...]], ...],
    slopes: tuple[tuple[float, ...], ...],
    start: tuple[float, ...],
    deviation: tuple[float, ...],
    goal: tuple[float | None, ...],
    sigma: tuple[float, ...],
    tolerance: tuple[float, ...],
    leave: float,
    steps: int,
    cover: tuple[tuple[float, float], ...],
) -> SoloTable:
    """Return the table; games that differ in lam alone share it."""
    sets = tuple((first, np.array(corners)) for first, corners in moves)
    axes = _axes(np.array(A), sets, start, deviation, goal, sigma, tolerance, steps, cover)
    pulls, short = _pulls(np.array(A), sets, goal, tolerance)
    problem = SoloProblem(np.array(A), sets, np.array(slopes), axes, leave, steps, pulls, short)
    size = [*start, 0.0][:2], [*deviation, 0.0][:2]
    bound, value = SoloGrid(problem).solve(*map(np.array, size), whole=bool(cover))
    return SoloTable(bound, axes, value)


def _axes(
    A: np.ndarray,
    sets: Sequence[tuple[int, np.ndarray]],
    start: Sequence[float],
    deviation: Sequence[float],
    goal: Sequence[float | None],
    sigma: Sequence[float],
    tolerance: Sequence[float],
    steps: int,
    cover: Sequence[tuple[float, float]],
) -> tuple[Axis, Axis | NoAxis]:
    """Return a grid that covers the way, with margins that make the rim unattractive."""
    corners = np.vstack([points for _, points in sets])
    size = len(start)
    if np.array_equal(A[:size, :size], np.eye(size)):
        travel = np.abs(corners).max(axis=0)
    else:
        travel = _travel(A, corners, start, goal, steps)
    spans = []
    for a, centre in enumerate(start):
        ends = [centre, centre if goal[a] is None else goal[a], *(cover[a] if cover else ())]
        rim = FAR * sigma[a] + float(np.abs(corners[:, a]).max()) + FAR * deviation[a]
        far = travel[a] + rim
        spans.append((min(ends) - far, max(ends) + far))
    spacing = [s / NODES_PER_DEVIATION for s in sigma]
    count = float(
        np.prod([(high - low) / h for (low, high), h in zip(spans, spacing, strict=True)])
    )
    coarser = max(1.0, (count / MOST_NODES) ** (1 / len(spans)))
    axes = [
        make_axis(span, goal[a], tolerance[a], coarser * spacing[a], sigma[a])
        for a, span in enumerate(spans)
    ]
    return axes[0], axes[1] if len(axes) > 1 else NoAxis()


def _pulls(
    A: np.ndarray,
    sets: Sequence[tuple[int, np.ndarray]],
    goal: Sequence[float | None],
    tolerance: Sequence[float],
) -> tuple[np.ndarray, np.ndarray]:
    """Return vectors l (K, 2), of which no input gains more than 1, and the steps short at zero."""
    size = len(goal)
    corners = np.vstack([points for _, points in sets])
    directions = np.zeros((0, 2))
    if np.array_equal(A[:size, :size], np.eye(size)):
        directions = np.array([[1.0, 0.0], [-1.0, 0.0]])
        if size == 2 and len(sets[0][1]) > 2:
            directions = Polytope("vertices", (sets[0][1],)).normals
    gains = (directions @ corners.T).max(axis=1)
    pulls = directions[gains > 0] / gains[gains > 0, None]
    aim = np.array([np.nan if g is None else g for g in goal])
    pulls = pulls[[not np.isnan(aim[np.flatnonzero(pull[:size])]).any() for pull in pulls]]
    aim = np.concatenate([np.nan_to_num(aim), np.zeros(2 - size)])
    return pulls, pulls @ aim - np.abs(pulls) @ np.pad(tolerance, (0, 2 - size))


def make_axis(
    span: tuple[float, float], goal: float | None, tolerance: float, spacing: float, sigma: float
) -> Axis:
    """Return nodes that cover ``span``, with the sides of the arrival region among them."""
    low, high = span
    if goal is None:
        return Axis(low, spacing, int(np.ceil((high - low) / spacing)) + 1, sigma, None)
    inside = int(np.ceil(2 * tolerance / spacing))
    if inside:
        spacing = 2 * tolerance / inside
    before = int(np.ceil((goal - tolerance - low) / spacing))
    after = int(np.ceil((high - goal - tolerance) / spacing))
    count = before + inside + after + 1
    return Axis(
        goal - tolerance - before * spacing, spacing, count, sigma, (before, before + inside)
    )


def _travel(
    A: np.ndarray,
    corners: np.ndarray,
    start: Sequence[float],
    goal: Sequence[float | None],
    steps: int,
) -> np.ndarray:
    """Return (2,) how far the inputs may carry the state in half the steps of the way."""
    free = np.array([*start, 0.0][:2])
    far, power, reach = np.zeros(2), np.eye(2), []
    wanted = np.array([0.0 if g is None else g for g in [*goal, None][:2]])
    fixed = np.array([g is not None for g in [*goal, None][:2]])
    for _ in range(steps):
        far = far + np.abs(corners @ power.T).max(axis=0)
        reach.append(far)
        free, power = A @ free, power @ A
        images = (np.abs(wanted - free) / np.maximum(far, 1e-300))[fixed]
        if images.sum() <= 1.5:  # for sets that are not boxes the way is longer
            break
    return reach[min(len(reach) // 2 + 1, len(reach) - 1)]


def image(B: np.ndarray, control: Polytope) -> np.ndarray:
    """Return the corners (V, 2) of B U, counter-clockwise; on a line, the second component is 0."""
    points = np.unique(control.vertices @ B.T, axis=0)
    if points.shape[1] == 1:
        return np.array([[points.min(), 0.0], [points.max(), 0.0]])
    return points if len(points) < 3 else Polytope("vertices", (points,)).vertices


def _slopes(B: np.ndarray, effort: float) -> np.ndarray:
    """Return (K, 2) tangents q of the effort, |B' q| <= effort, zero among them."""
    slopes = [np.zeros(2)]
    if effort > 0:
        angles = np.arange(16) * np.pi / 8
        directions = np.column_stack([np.cos(angles), np.sin(angles)])[:, : len(B)]
        for direction in directions[:: 1 if len(B) == 2 else 8]:
            size = float(np.abs(direction @ B).max())
            if size > 0:
                slopes.append(np.array([*(direction * effort / size), 0.0][:2]))
    return np.array(slopes)
