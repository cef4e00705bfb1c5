r"""The shortest way around bodies at rest in the plane, as a lower bound on the steps it takes.

During a step, both ends are on the outer side of one face of each body, so the mean moves along a
path of segments that enters no body.  The time of a displacement d is

    max over directions a of  a'd / (longest step along a).

This is a gauge: a straight segment takes no longer than any other way between its ends, so some
quickest way bends at corners only.  Dijkstra's method finds it among the corners that see each
other.

Bodies shrink a little, since means may overlap with them by ``tol.LENGTH`` and miss goals by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.barriers import Barrier
from ppg_env.game.step_lengths import step_directions, step_lengths

SHRINK = 4 * tol.LENGTH
"""Length by which every face of a body moves inwards."""

DEPTH = SHRINK / 40
"""Depth in a shrunk body from which a segment enters it."""

LATE = 1e-4
"""Part of a step that is not counted, for rounding and for goals that are missed."""

MOST_CORNERS = 600
"""Corners beyond which ways are not looked for: all pairs are compared."""


def least_steps(agent: Agent, bodies: Sequence[Barrier], horizon: int) -> int | None:
    """Return a lower bound on the arrival of an agent in the plane past bodies that rest.

    The result is None if no way takes as few steps as the horizon.  ``bodies`` keep apart from the
    agent between steps, too.
    """
    polygons = [p for body in bodies if (p := _shrunk(body)) is not None]
    corners = np.concatenate(
        [np.array([agent.start[:2], agent.goal[:2]]), *(p[0] for p in polygons)]
    )
    covered = np.zeros(len(corners), dtype=bool)
    for _, normals, offsets in polygons:
        covered |= (corners @ normals.T - offsets < -DEPTH).all(axis=1)
    if covered[:2].any() or len(corners) - covered.sum() > MOST_CORNERS:
        return 0
    corners = corners[~covered]
    directions = step_directions(agent)
    lengths = step_lengths(agent, directions, horizon)
    quickest = _quickest(corners, polygons, directions / lengths.max(axis=0)[:, None])
    done = np.cumsum((lengths / lengths.max(axis=0)).max(axis=1)) >= quickest - LATE
    return int(done.argmax()) + 1 if done.any() else None


def _shrunk(body: Barrier) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return corners, normals and offsets of a smaller body; None if it is too thin."""
    normals, offsets = body.collision.faces
    centre = body.collision.vertices.mean(axis=0)
    depths = offsets - normals @ centre
    if depths.min() <= 2 * SHRINK:
        return None
    share = 1 - SHRINK / depths.min()
    corners = body.path[0] + centre + share * (body.collision.vertices - centre)
    return corners, normals, normals @ (body.path[0] + centre) + share * depths


def _quickest(
    corners: np.ndarray,
    polygons: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]],
    speeds: np.ndarray,
) -> float:
    """Return the time of the quickest way from the first of the ``corners`` to the second."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    one, other = np.triu_indices(len(corners), 1)
    for _, normals, offsets in polygons:
        clear = corners @ normals.T - offsets + DEPTH
        sides = clear >= 0
        near = np.flatnonzero(~(sides[one] & sides[other]).any(axis=1))
        meets = near[_enters(clear[one[near]], clear[other[near]])]
        one, other = np.delete(one, meets), np.delete(other, meets)
    moves = corners[other] - corners[one]
    times = [np.maximum((sign * moves @ speeds.T).max(axis=1), 1e-9) for sign in (1, -1)]
    ends = np.concatenate([one, other]), np.concatenate([other, one])
    graph = csr_array((np.concatenate(times), ends), shape=(len(corners),) * 2)
    result = float(dijkstra(graph, indices=0)[1])
    return result if np.isfinite(result) else inf


def _enters(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return (S,) whether segments with clearances (S, F) at their ends enter a body.

    The parts of a segment on the inner sides of all faces have to be longer than rounding.
    """
    slopes = after - before
    with np.errstate(divide="ignore", invalid="ignore"):
        crossings = -before / slopes
    first = np.where(slopes < 0, crossings, -inf).max(axis=1).clip(0.0)
    last = np.where(slopes > 0, crossings, inf).min(axis=1).clip(max=1.0)
    outside = ((slopes == 0) & (before >= 0)).any(axis=1)
    return np.asarray(~outside & (first < last - 1e-12))
