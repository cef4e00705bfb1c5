"""Bodies that have another size in each copy: the faces of all encounters, copy by copy."""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.arrays import Tables
from ppg_env.env.encounter_tables import extents
from ppg_env.env.placement import supports
from ppg_env.game.game import Game


class OwnBodies:
    """Faces of the collision sets in ``copies`` of ``game``.

    Both bodies' parts of an offset grow with the factors of their sizes; normals stay.
    """

    def __init__(self, game: Game, copies: int) -> None:
        bodies = [*(a.shape for a in game.agents), *(o.shape for o in game.obstacles)]
        N, touch = len(game.agents), tol.LENGTH * game.unit
        self._touch, self._agents = touch, N
        normals, parts, sides = [], [], []
        for encounter in game.encounters:
            i, k = encounter.agents[0], encounter.obstacle
            b = encounter.agents[1] if k is None else N + k
            normals.append(encounter.collision.normals)
            parts.append(np.stack(supports(bodies[i], bodies[b], normals[-1])))
            sides.append(np.tile([[i], [min(b, N)]], len(normals[-1])))  # N: an obstacle
        self._first = np.cumsum([0, *(len(rows) for rows in normals)], dtype=np.int64)
        self._parts = np.concatenate([np.zeros((2, 0)), *parts], axis=1)
        self._sides = np.concatenate([np.zeros((2, 0), dtype=np.int64), *sides], axis=1)
        every = np.concatenate([np.zeros((0, game.dim)), *normals])
        self._normals = np.tile(every, (copies, 1))
        self._offsets = np.tile(self._parts.sum(axis=0), (copies, 1))
        self._depths = self._offsets - touch
        self._bounds = extents(game)
        self._extents = self._bounds.copy()

    def tables(self, tables: Tables) -> Tables:
        """Return ``tables`` that hold these faces."""
        pair = tables.pair.copy()
        pair[:, 2], pair[:, 3] = self._first[:-1], self._first[1:]
        return tables._replace(
            pair=pair,
            own_faces=int(self._first[-1]),
            normals=self._normals,
            offsets=self._offsets.reshape(-1),
            depths=self._depths.reshape(-1),
            extents=self._extents,
        )

    def resize(self, size: np.ndarray, rows: np.ndarray) -> None:
        """Give the bodies of the copies ``rows`` their factors of ``size`` (C, N)."""
        factors = np.concatenate([size[rows], np.ones((len(rows), 1))], axis=1)
        offsets = (factors[:, self._sides[0]] * self._parts[0]
                   + factors[:, self._sides[1]] * self._parts[1])  # fmt: skip
        self._offsets[rows], self._depths[rows] = offsets, offsets - self._touch
        # Boxes hold the bodies of all copies: only the pairs that are compared depend on them.
        low, high = (f[:, None] for f in (size.min(axis=0), size.max(axis=0)))
        N, bounds = self._agents, self._bounds[:, : self._agents]
        self._extents[0, :N] = np.minimum(low * bounds[0], high * bounds[0]) - self._touch
        self._extents[1, :N] = np.maximum(low * bounds[1], high * bounds[1]) + self._touch
