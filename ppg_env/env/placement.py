"""Where drawn bodies may stand: the checks of game files, for many copies at once.

A start is refused if the body overlaps another at time 0, stands in an obstacle or outside its
workspace, or lies in its own arrival region without being the goal.  A goal is refused if it lies
in an obstacle that never leaves it or outside the workspace, or, where bodies stay, if two of them
would park on each other.

Agents are placed one after the other, those with given places first: a place is drawn again, up to
``TRIES`` times, until it is free.  Where an agent finds none, the whole episode is drawn again, up
to ``ROUNDS`` times (:mod:`ppg_env.env.variation`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.arrays import Tables
from ppg_env.game.game import Game
from ppg_env.game.polytope import Polytope
from ppg_env.game.workspace import lengths_per_unit

TRIES = 32
ROUNDS = 32


@dataclass
class Places:
    """Places of the bodies in M copies.

    Attributes
    ----------
    start, goal : (M, N, n) states, goals padded with zeros.
    size : (M, N) factors of the bodies.
    playing : (M, N) whether the agent plays.
    """

    start: np.ndarray
    goal: np.ndarray
    size: np.ndarray
    playing: np.ndarray


@dataclass(frozen=True)
class _Faces:
    """Faces of one agent's collision sets with all other bodies, agents and then obstacles.

    normals (F, d) point from the other body to the agent; a face lies at size * own (F,) plus the
    other's size * other (F,); body (F,) is the other body, ``first`` the first face of each;
    touch (B,) is the depth within which two bodies only touch.
    """

    normals: np.ndarray
    own: np.ndarray
    other: np.ndarray
    body: np.ndarray
    first: np.ndarray
    touch: np.ndarray


class Placement:
    """Checks and draws places of the agents of ``game``, whose tables are given."""

    def __init__(self, game: Game, tables: Tables) -> None:
        self._game, self._tables = game, tables
        self._faces = _faces(game)
        self._initial = np.array([o.positions(0)[0] for o in game.obstacles]).reshape(-1, game.dim)
        rests = [obstacle.positions(obstacle.rest)[-1] for obstacle in game.obstacles]
        self._final = np.array(rests).reshape(-1, game.dim)
        lasts = [o.until is None and (o.path is None or tables.stay) for o in game.obstacles]
        self._lasting = np.array(lasts, dtype=bool)

    def starts_fit(self, i: int, places: Places, placed: np.ndarray) -> np.ndarray:
        """Return (M,) whether agent i may start where it is, given those ``placed`` (M, N)."""
        point = places.start[:, i]
        apart = self._apart(i, places.start, places.size, self._initial)
        there = np.hstack([placed & places.playing, np.ones((len(point), len(self._initial)))])
        return (apart | ~there.astype(bool)).all(axis=1) & self._inside(i, point, point.shape[1])

    def goals_fit(self, i: int, places: Places, placed: np.ndarray) -> np.ndarray:
        """Return (M,) whether agent i may have its goal, given those ``placed`` (M, N)."""
        point = places.goal[:, i]
        apart = self._apart(i, places.goal, places.size, self._final)
        lasting = np.broadcast_to(self._lasting, (len(point), self._lasting.size))
        there = np.hstack([placed & places.playing & self._tables.stay, lasting])
        size = self._game.agents[i].goal.size
        return (apart | ~there).all(axis=1) & self._inside(i, point, size)

    def arrived(self, i: int, places: Places) -> np.ndarray:
        """Return (M,) whether agent i starts in its arrival region, but not at its goal."""
        size, tables = self._game.agents[i].goal.size, self._tables
        away = np.abs(places.start[:, i, :size] - places.goal[:, i, :size])
        inside = (away <= tables.tolerance[i, :size]).all(axis=1) & away.any(axis=1)
        return inside & (not tables.scheduled)

    def draw(
        self,
        free: list[int],
        target: np.ndarray,
        fit: Callable[[int, Places, np.ndarray], np.ndarray],
        places: Places,
        propose: Callable[[int, int, np.ndarray], np.ndarray],
    ) -> np.ndarray:
        """Draw places of the ``free`` agents, written to ``target`` (M, N, n).

        Return (M,) whether all of them have found one.

        ``target`` belongs to ``places``; ``propose(i, attempt, rows)`` returns states of agent i
        in some copies, and ``fit`` is one of the two checks.
        """
        M, N = places.playing.shape
        placed, found = np.ones((M, N), dtype=bool), np.ones(M, dtype=bool)
        placed[:, free] = False
        for i in free:
            rows = np.flatnonzero(places.playing[:, i])
            for attempt in range(TRIES):
                if not rows.size:
                    break
                target[rows, i] = propose(i, attempt, rows)
                some = Places(*(getattr(places, key)[rows] for key in vars(places)))
                rows = rows[~fit(i, some, placed[rows])]
            placed[:, i] = True
            found[rows] = False
        return found

    def valid(self, places: Places) -> np.ndarray:
        """Return (M,) whether all playing agents fit."""
        M, N = places.playing.shape
        result = np.ones(M, dtype=bool)
        for i in range(N):
            earlier = np.broadcast_to(np.arange(N) < i, (M, N))
            fits = self.starts_fit(i, places, earlier) & self.goals_fit(i, places, earlier)
            result &= (fits & ~self.arrived(i, places)) | ~places.playing[:, i]
        return result

    def _apart(
        self, i: int, points: np.ndarray, size: np.ndarray, obstacles: np.ndarray
    ) -> np.ndarray:
        """Return (M, N + O) whether agent i is clear of all bodies, itself included."""
        faces, (M, N, _), d = self._faces[i], points.shape, self._game.dim
        if not faces.first.size:
            return np.ones((M, N), dtype=bool)
        every = np.concatenate(
            [points[..., :d], np.broadcast_to(obstacles, (M, *obstacles.shape))], axis=1
        )
        sizes = np.concatenate([size, np.ones((M, len(obstacles)))], axis=1)
        away = every[:, [i]] - every[:, faces.body]
        depth = sizes[:, [i]] * faces.own + sizes[:, faces.body] * faces.other
        clear = np.einsum("mfd,fd->mf", away, faces.normals) - depth
        gaps = np.maximum.reduceat(clear, faces.first, axis=1)
        return np.insert(gaps >= -faces.touch, i, True, axis=1)

    def _inside(self, i: int, point: np.ndarray, size: int) -> np.ndarray:
        """Return (M,) whether the first ``size`` components are within the agent's workspaces."""
        agent, result = self._game.agents[i], np.ones(len(point), dtype=bool)
        for region in agent.within:
            if region.dim <= size:
                excess = point[:, : region.dim] @ region.normals.T - region.offsets
                beyond = (excess / lengths_per_unit(agent, region.normals)).max(axis=1)
                result &= beyond <= tol.LENGTH * agent.unit
        return result


def supports(
    shape: Polytope, other: Polytope, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts of the two bodies in the offsets of the set other + (-shape), (F,) each."""
    return shape.support(-normals), other.support(normals)


_Row = tuple[np.ndarray, np.ndarray, np.ndarray, float]
"""Normals, own and other parts, and touch of one collision set."""


def _faces(game: Game) -> list[_Faces]:
    """Return the faces of each agent."""
    N, bodies = len(game.agents), len(game.agents) + len(game.obstacles)
    shapes = [*(a.shape for a in game.agents), *(o.shape for o in game.obstacles)]
    rows: list[dict[int, _Row]] = [{} for _ in range(N)]
    for encounter in game.encounters:
        i, k = encounter.agents[0], encounter.obstacle
        b = encounter.agents[1] if k is None else N + k
        normals = encounter.collision.normals
        own, other = supports(shapes[i], shapes[b], normals)
        touch = tol.LENGTH * min(game.agents[j].unit for j in encounter.agents)
        rows[i][b] = normals, own, other, touch
        if k is None:
            rows[b][i] = -normals, other, own, touch
    return [_joined(rows[i], [b for b in range(bodies) if b != i], game.dim) for i in range(N)]


def _joined(rows: dict[int, _Row], bodies: list[int], dim: int) -> _Faces:
    counts = [len(rows[b][0]) for b in bodies]
    columns = [[rows[b][k] for b in bodies] for k in range(3)]
    return _Faces(
        normals=np.concatenate([np.zeros((0, dim)), *columns[0]]),
        own=np.concatenate([np.zeros(0), *columns[1]]),
        other=np.concatenate([np.zeros(0), *columns[2]]),
        body=np.repeat(np.array(bodies, dtype=np.int64), counts),
        first=np.cumsum([0, *counts], dtype=np.int64)[:-1],
        touch=np.array([rows[b][3] for b in bodies]),
    )
