r"""Cheaper ways of agents past each other: few agents leave and find new ways past the others.

Each new way is the shortest over the points of one agent (:mod:`solvers.engine.way_grid`) that
keeps a margin from the others as they move.  First one agent leaves, then two and three, which find
their ways one after the other (large neighbourhood search, Li et al. 2021).  The cost of ways is
that of their time, and of as many steps again as there are events at which a margin is missing, to
others or to walls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, permutations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.barriers import Barrier
from ppg_env.game.game import Game
from ppg_env.game.margins import encounter_units
from ppg_env.game.polytope import Polytope
from solvers.budget import Budget
from solvers.engine.way_grid import MovingBody, WayGrid

MARGIN = 2.5
"""Margin that new ways keep, up to the cap of the game: beyond it, risks are small."""

MOST_WAYS = 60
"""New ways of single agents that are looked for, at most."""

LARGEST_GROUP = 3
"""Agents that leave together, at most."""

Ways = list[np.ndarray]


class WayImprovement:
    """The search for cheaper ways over ``grids``; agents are numbered in this order.

    ``costs`` are those of one step of time, one for each of the ``movers``.
    """

    def __init__(
        self,
        game: Game,
        movers: tuple[int, ...],
        grids: Sequence[WayGrid],
        costs: Sequence[float],
        budget: Budget,
    ) -> None:
        self._game, self._grids, self._costs, self._budget = game, grids, costs, budget
        self._alone = [int(np.ceil(grid.left[0, 0] - tol.LENGTH)) for grid in grids]
        self._collisions: dict[tuple[int, int], tuple[Polytope, np.ndarray]] = {}
        numbers = {i: k for k, i in enumerate(movers)}
        self._walls: list[list[tuple[Barrier, float]]] = [[] for _ in movers]
        for encounter in game.encounters:
            if not set(encounter.agents) <= set(movers):
                continue
            room = min(MARGIN, game.margin_cap) * encounter_units(game, encounter).max(axis=1)
            if encounter.obstacle is not None:
                path = game.obstacles[encounter.obstacle].positions(game.horizon)
                wall = Barrier(encounter.collision, path, game.horizon + 1)
                if wall.rests and room.any():
                    self._walls[numbers[encounter.agents[0]]].append((wall, float(room.max())))
            else:
                i, j = (numbers[a] for a in encounter.agents)
                mirrored = Polytope.from_vertices(-encounter.collision.vertices)
                self._collisions[i, j] = encounter.collision, room
                self._collisions[j, i] = mirrored, room

    def variants(self, ways: Ways) -> Iterator[Ways]:
        """Yield better ways (T_k + 1, d), first with margins to walls, then without."""
        for clear in (True, False):
            self._count, self._clear, result = 0, clear, ways
            for grid, walls in zip(self._grids, self._walls, strict=True):
                grid.ask_for_room(walls if clear else [])
            while (better := self._better(result)) is not None:
                result = better
            yield result

    def _better(self, ways: Ways) -> Ways | None:
        """Return ways that cost less, if some are found."""
        cost = sum(self._costs_of(ways))
        for group in self._groups(ways):
            others = self._replaced(ways, group)
            if others is not None and sum(self._costs_of(others)) < cost - tol.IMPROVEMENT:
                return others
            if self._count >= MOST_WAYS or self._budget.out:
                break
        return None

    def _groups(self, ways: Ways) -> Iterator[tuple[int, ...]]:
        """Yield orders of few agents, of which the first can gain, those who can most first."""
        alone = [c * t for c, t in zip(self._costs, self._alone, strict=True)]
        extra = np.subtract(self._costs_of(ways), alone)
        agents = np.argsort(-extra, kind="stable").tolist()
        for size in range(1, min(LARGEST_GROUP, len(agents)) + 1):
            for group in permutations(agents, size):
                if extra[group[0]] > tol.IMPROVEMENT:
                    yield group

    def _costs_of(self, ways: Ways) -> list[float]:
        """Return what each agent pays for its time and for missing margins."""
        result = []
        for cost, walls, way in zip(self._costs, self._walls, ways, strict=True):
            near = sum(self._near(wall, room, way) for wall, room in walls if self._clear)
            result.append(cost * (len(way) - 1 + near))
        for i, j in combinations(range(len(ways)), 2):
            if (i, j) in self._collisions:
                missing = self._missing(i, j, ways)
                result[i] += self._costs[i] * missing
                result[j] += self._costs[j] * missing
        return result

    def _near(self, wall: Barrier, room: float, way: np.ndarray) -> int:
        """Return the number of steps of a way that keep less distance than ``room`` from a wall."""
        normals, offsets = wall.collision.faces
        clear = (way - wall.path[0]) @ normals.T - offsets >= room - tol.LENGTH
        return int((~(clear[:-1] & clear[1:]).any(axis=1)).sum())

    def _missing(self, i: int, j: int, ways: Ways) -> int:
        """Return the number of events of a pair at which the margin is missing."""
        collision, room = self._collisions[i, j]
        normals, offsets = collision.faces
        between = self._waiting(ways[i]) - self._waiting(ways[j])
        clear = between @ normals.T - offsets >= room[:, None] - tol.LENGTH
        if self._game.collisions == "swept":
            clear = clear[:-1] & clear[1:]
        missing = ~clear.any(axis=1)
        stays = self._game.on_goal == "stay"
        return int(missing[: None if stays else min(len(ways[i]), len(ways[j])) - 1].sum())

    def _replaced(self, ways: Ways, group: tuple[int, ...]) -> Ways | None:
        """Return the ways after those of ``group`` were found again, one after the other."""
        result, present = list(ways), [k for k in range(len(ways)) if k not in group]
        for k in group:
            self._count += 1
            bodies = [self._body(k, j, result[j]) for j in present if (k, j) in self._collisions]
            way = self._grids[k].way_past(bodies)
            if way is None:
                return None
            result[k] = way
            present.append(k)
        return result

    def _body(self, k: int, j: int, way: np.ndarray) -> MovingBody:
        """Return agent ``j`` on its way, with the margin, as an agent ``k`` meets it."""
        game, (collision, room) = self._game, self._collisions[k, j]
        until = game.horizon + 1 if game.on_goal == "stay" else len(way) - 1
        return MovingBody(
            Barrier(collision, self._waiting(way), until),
            game.collisions == "swept",
            game.on_goal == "stay",
            room,
        )

    def _waiting(self, way: np.ndarray) -> np.ndarray:
        """Return the way (H+1, d) with a wait at its end."""
        return way[np.minimum(np.arange(self._game.horizon + 1), len(way) - 1)]
