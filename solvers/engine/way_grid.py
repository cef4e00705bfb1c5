r"""Points on which ways of one agent are looked for, and the steps between them.

Lines along every axis pass through start and goal, through the corners of what bodies at rest
close and the middle between them, so that narrow ways have points, and at regular distances.  A
step joins two points if an agent can go that far and one face of each body at rest is clear at
both, as programs require.  Agents with inertia keep to the speed that they reach from rest within
a few steps.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import inf

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.barriers import Barrier
from ppg_env.game.reachability import reach_upper
from ppg_env.game.step_lengths import position_box, step_directions
from ppg_env.game.workspace import workspace_limits, workspace_rows

MOST_POINTS, LIMIT = 1500, 6000
"""Points of one agent before the search for ways of several becomes slow, and at most."""

IN_SPACE = 15_000
"""Points in three dimensions."""

PER_STEP = (3.0, 2.0, 1.0, 0.5)
"""Lines per step, of which the largest affordable number is taken; at most one in space."""

DETAIL = 1e-3
"""Weight of the distance where it decides between points with as many steps left."""

MOST_FACES = 64
"""Faces of a body that moves; an agent is not known to pass it on the side of further ones."""

CHUNK = 64
"""Points whose steps are computed at once, to save memory."""


class WayGrid:
    """The points of one agent, and the steps between them.

    Parameters
    ----------
    bodies : the bodies that the agent meets, of which those at rest close steps.
    region : lowest and highest position (d,) of all points.
    agility : number of steps after which speeds from rest are allowed.
    most : number of points that the regular lines may add up to.

    Attributes
    ----------
    points : (K, d) positions; the first is the start, the second the goal.
    left : (H+1, K) number of steps to the goal from each point at each time, infinite if the goal
        cannot be reached in time past the bodies that move.
    after : per point, the points one step later, itself included, nearest to the goal first.
    """

    def __init__(
        self,
        agent: Agent,
        bodies: list[Barrier],
        region: tuple[np.ndarray, np.ndarray],
        horizon: int,
        agility: int,
        *,
        swept: bool,
        stays: bool,
        most: int = MOST_POINTS,
    ) -> None:
        self._agent, self._swept, self._most = agent, swept, most
        self._rest = [body for body in bodies if body.rests]
        self.moving = [MovingBody(body, swept, stays) for body in bodies if not body.rests]
        self._directions = step_directions(agent)
        self._lengths = lengths_from_rest(agent, self._directions, agility)
        self.points = self._free_points(region, horizon)
        self._masks = [_clear(body, self.points) for body in self._rest]
        sources, targets, times = self._steps()
        from scipy.sparse import csr_array

        shape = (len(self.points),) * 2
        self._graph = csr_array((np.maximum(times, 1e-6), (targets, sources)), shape=shape)
        self._nearest = nearest = self.times_to(1)
        self.left = np.tile(nearest, (horizon + 1, 1))
        outward = sources != 1
        self._steps_out = sources[outward], targets[outward]
        self._sources = np.unique(sources[outward], return_index=True)
        self._roomy, self._costs = list[np.ndarray](), np.ones(int(outward.sum()))
        if self.moving:
            self.left = self._past(self.moving)
        self.after = self._sorted(nearest, sources, targets)

    def times_to(self, point: int) -> np.ndarray:
        """Return (K,) the number of steps from each point to one of them; infinite without way."""
        from scipy.sparse.csgraph import dijkstra

        return np.asarray(dijkstra(self._graph, indices=point))

    def _free_points(self, region: tuple[np.ndarray, np.ndarray], horizon: int) -> np.ndarray:
        """Return start, goal and the points in the workspace that no body at rest covers."""
        agent, d = self._agent, self._agent.dim
        low, high = position_box(agent, horizon)
        low, high = np.maximum(low, region[0]), np.minimum(high, region[1])
        ends = np.array([agent.start[:d], agent.goal[:d]])
        rows, limits = workspace_rows(agent), workspace_limits(agent, horizon).max(axis=0)
        places = ~rows[:, d:].any(axis=1)
        for count in PER_STEP[2 * (d > 2) :]:
            axes = [self._lines(k, low[k], high[k], count) for k in range(d)]
            points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, d)
            free = (points @ rows[places, :d].T <= limits[places] + tol.LENGTH).all(axis=1)
            for body in self._rest:
                free &= _clear(body, points).any(axis=1)
            points = points[free]
            if len(points) <= self._most:
                break
        known = (np.abs(points[:, None] - ends) <= tol.LENGTH).all(axis=2).any(axis=1)
        return np.concatenate([ends, points[~known][: max(LIMIT, self._most)]])

    def _lines(self, k: int, low: float, high: float, count: float) -> np.ndarray:
        """Return the coordinates of lines across axis ``k``, ``count`` of them per step."""
        agent = self._agent
        along = np.abs(self._directions).max(axis=1) == 1
        sizes = np.abs(self._directions[along, k]) * self._lengths[along]
        spacing = max(float(sizes.max()) / count, (high - low) / MOST_POINTS, 1e-9)
        start, goal = float(agent.start[k]), float(agent.goal[k])
        corners = [
            bound[k] + body.path[0, k] for body in self._rest for bound in body.collision.bounds
        ]
        corners = sorted({low, high, *(c for c in corners if low < c < high)})
        middles = [(a + b) / 2 for a, b in pairwise(corners)]
        steps = np.arange(np.ceil((low - start) / spacing), np.floor((high - start) / spacing) + 1)
        lines = np.array([*middles, *corners, *(start + spacing * steps)])
        lines = lines[(lines >= low - tol.LENGTH) & (lines <= high + tol.LENGTH)]
        kept = sorted({start, goal})
        close = spacing / 4 if count > 1 else spacing / 1000
        for line in lines.tolist():  # those close to others add nothing
            if all(abs(line - other) > close for other in kept):
                kept.append(line)
        return np.array(kept)

    def _steps(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return sources, targets and durations (S,), at most one step, of all steps."""
        points, parts = self.points, []
        along = np.abs(self._directions).max(axis=1) == 1
        axes, reach = self._directions[along], self._lengths[along] * (1 + 2 * tol.LENGTH)
        for first in range(0, len(points), CHUNK):
            near = np.ones((len(points[first : first + CHUNK]), len(points)), dtype=bool)
            for axis, length in zip(axes, reach, strict=True):  # few points are that near
                places = points @ axis
                near &= places[None] - places[first : first + CHUNK, None] <= length
            sources, targets = np.nonzero(near)
            moves = points[targets] - points[first + sources]
            times = ((moves @ self._directions.T) / self._lengths).max(axis=1)
            open_ = times <= 1 + tol.LENGTH
            for mask in self._masks if self._swept else []:
                open_ &= (mask[sources + first] & mask[targets]).any(axis=1)
            parts.append((sources[open_] + first, targets[open_], times[open_]))
        return tuple(np.concatenate(part) for part in zip(*parts, strict=True))  # type: ignore[return-value]

    def ask_for_room(self, walls: list[tuple[Barrier, float]]) -> None:
        """Let ways pass bodies at rest at a distance, or else count one more step for each step."""
        self._roomy = [_clear(wall, self.points, room) for wall, room in walls]
        self._costs = 1.0 + self._narrow(*self._steps_out)

    def _narrow(self, sources: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Return the number (S,) of bodies at rest to which steps keep less distance than asked."""
        result = np.zeros(len(sources))
        for mask in self._roomy:
            result += ~(mask[sources] & mask[targets]).any(axis=1)
        return result

    def way_past(self, bodies: list[MovingBody]) -> np.ndarray | None:
        """Return the shortest way (T+1, d) in time past obstacles and further bodies, if any."""
        moving = [*self.moving, *bodies]
        left = self._past(moving)
        if left[0, 0] == inf:
            return None
        way = [0]
        while way[-1] != 1:
            t, targets = len(way) - 1, self.after[way[-1]]
            after = left[t + 1, targets] + self._narrow(np.full(len(targets), way[-1]), targets)
            for body in moving:
                after[~body.passed(t, np.full(len(targets), way[-1]), targets, targets == 1)] = inf
            way.append(int(targets[after.argmin()]))
        return np.asarray(self.points[way])

    def _past(self, moving: list[MovingBody]) -> np.ndarray:
        """Return :attr:`left` among bodies that move."""
        horizon, (sources, targets) = len(self.left) - 1, self._steps_out
        for body in moving:
            body.look_at(self.points, horizon)
        result = np.full((horizon + 1, len(self.points)), inf)
        result[:, 1] = 0.0
        (points, firsts), arrives = self._sources, targets == 1
        for t in range(horizon - 1, -1, -1):
            after = self._costs + result[t + 1, targets]
            for body in moving:
                after[~body.passed(t, sources, targets, arrives)] = inf
            result[t, points] = np.minimum.reduceat(after, firsts)
        # Steps are whole there; where as many are left, the nearer point is better.
        return result + DETAIL * np.minimum(self._nearest, horizon)

    def _sorted(
        self, nearest: np.ndarray, sources: np.ndarray, targets: np.ndarray
    ) -> list[np.ndarray]:
        """Return the targets of each point from which the goal can be reached."""
        useful = nearest[targets] < inf
        sources, targets = sources[useful], targets[useful]
        order = np.lexsort((nearest[targets], sources))
        ends = np.searchsorted(sources[order], np.arange(len(self.points) + 1))
        return [targets[order[a:b]] for a, b in pairwise(ends)]


class MovingBody:
    """A body that moves, and the faces of it that are clear at the points of an agent, as bits.

    A face is clear at a distance of ``room`` (H+1,).
    """

    def __init__(
        self, body: Barrier, swept: bool, stays: bool, room: np.ndarray | None = None
    ) -> None:
        self._body, self._swept, self._stays = body, swept, stays
        self._room = np.zeros(len(body.path)) if room is None else room
        self._clear = np.zeros((0, 0), dtype=np.uint64)

    def look_at(self, points: np.ndarray, horizon: int) -> None:
        """Compute which faces are clear at ``points`` (K, d) at all times."""
        normals, offsets = self._body.collision.faces
        path = self._body.path[: horizon + 1] @ normals.T + offsets
        path = path + self._room[: horizon + 1, None]
        self._clear = _as_bits(points @ normals.T - path[:, None] >= -tol.LENGTH)

    def passed(
        self, t: int, sources: np.ndarray, targets: np.ndarray, arrives: np.ndarray
    ) -> np.ndarray:
        """Return (S,) whether steps at t keep apart; those that ``arrive``, up to the end too."""
        until, before, after = self._body.until, self._clear[t], self._clear[t + 1]
        if self._swept:
            result = (before[sources] & after[targets]).astype(bool) | (t >= until)
        else:
            result = after[targets].astype(bool) | arrives | (t + 1 >= until)
        if self._stays and arrives.any():
            result[arrives] &= self._parked(t + 1, targets[arrives])
        return np.asarray(result)

    def _parked(self, t: int, points: np.ndarray) -> np.ndarray:
        """Return whether an agent can stand at ``points`` from t on."""
        clear = self._clear[t : self._body.until + 1, points]
        if self._swept:
            clear = clear[:-1] & clear[1:]
        return np.asarray(clear.astype(bool).all(axis=0))


def _as_bits(faces: np.ndarray) -> np.ndarray:
    """Return (..., F) booleans as bits of whole numbers; faces beyond their size do not count."""
    bits = np.left_shift(np.uint64(1), np.arange(min(faces.shape[-1], MOST_FACES), dtype=np.uint64))
    return np.asarray(faces[..., :MOST_FACES].astype(np.uint64) @ bits)


def _clear(body: Barrier, points: np.ndarray, room: float = 0.0) -> np.ndarray:
    """Return (K, F) which faces of a body at rest are clear at ``points``, by ``room``."""
    normals, offsets = body.collision.faces
    return np.asarray((points - body.path[0]) @ normals.T - offsets >= room - tol.LENGTH)


def lengths_from_rest(agent: Agent, directions: np.ndarray, agility: int) -> np.ndarray:
    """Return (F,) the mean displacement in a step along ``directions``, of ``agility`` from rest.

    It is a whole step of agents that move by their controls.
    """
    start = agent.start.copy()
    start[agent.dim :] = 0.0
    rows = np.hstack([directions, np.zeros((len(directions), agent.state_dim - agent.dim))])
    resting = replace(agent, start=start)
    ahead = reach_upper(resting, rows, agility)[agility] - rows @ start
    return np.maximum(ahead / agility, 1e-9)
