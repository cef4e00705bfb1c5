r"""Free space: where an agent's mean can be at each time among bodies on known paths.

Positions are covered by cells.  A cell is blocked during an event if it lies wholly inside one
collision set, so that no mean can be in it.  With S_t the cells that may hold the mean at t and
D_t the displacements that a step allows (:mod:`ppg_env.game.step_lengths`),

    S_{t+1} = { c not blocked : c is connected to S_t within the free cells of S_t + D_t }

contains the mean at t + 1, within the reachable sets of an agent alone (without connection where
bodies keep apart at instants alone).  The
first t at which the goal's cell is in S_t bounds the arrival from below, and a goal that is in no
S_t is out of reach: a proof.  That a cell is in S_t proves nothing.

Where bodies move, a step is divided, so that they do not pass over cells in one go.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ppg_env.game.barriers import Barrier
from ppg_env.game.cells import SLACK, Cells, connected, dilated
from ppg_env.game.game import Game
from ppg_env.game.reachability import plan_upper
from ppg_env.game.step_lengths import position_box, step_directions, step_lengths
from ppg_env.game.workspace import workspace_limits, workspace_rows

MOST_CELLS = {1: 4_000, 2: 25_000, 3: 120_000}
"""Largest number of cells by dimension; spaces of more dimensions are not divided."""

PER_STEP = (1, 2, 4, 8, 12, 16, 24, 32)
"""Numbers of cells per step along an axis, of which the largest affordable one is taken."""

SHARE = 0.05
"""A step is shorter than a whole number of cells by this part of a cell: rounded up, it is then
hardly longer."""

ZOOMS = 3
"""Number of times that cells are made finer within the space that is connected to the start."""

PARTS = (1, 2, 4)
"""Numbers of parts of a step."""

TICKS = 4
"""Parts of a step that count as times where ways are looked for."""

SPANS = (1, 4)
"""Numbers of steps over which displacements are bounded at once: cells round each of them up."""


class FreeSpace:
    """The cells that an agent's mean can reach, S_0, S_1, ... of the module's docstring.

    Attributes
    ----------
    inner : count only centres of cells, and moves from centre to centre, which proves nothing
        but shows ways that plans can follow.  Times are then parts of steps (:data:`TICKS`), so
        that ways hardly bend within one.
    finer : number of times as many cells.
    bodies : the bodies that it can meet.
    cells : the cells; None if goal and start are not connected.
    reached : the masks S_t, as far as they have been computed.
    """

    def __init__(
        self,
        game: Game,
        index: int,
        bodies: Sequence[Barrier],
        *,
        inner: bool = False,
        finer: int = 1,
    ) -> None:
        self._game, self._agent = game, game.agents[index]
        self._rounding, self._most = 0.0 if inner else 1.0, finer * MOST_CELLS[game.dim]
        self._directions = step_directions(self._agent)
        self._lengths = step_lengths(self._agent, self._directions, game.horizon)
        padding = np.zeros((len(self._directions), self._agent.state_dim - game.dim))
        rows = np.hstack([self._directions, padding])
        self._upper = plan_upper(self._agent, rows, game.horizon)
        self._longest = self._extents(self._lengths.max(axis=0))
        self.start, self.goal = (p[: game.dim] for p in (self._agent.start, self._agent.goal))
        self._swept = game.collisions == "swept"
        self.bodies = [body for body in bodies if body.meets(*self._whole_box())]
        if inner:
            self.bodies = [body.slowed(TICKS) for body in self.bodies]
            self._lengths = np.repeat(self._lengths / TICKS, TICKS, axis=0)
            self._upper = np.vstack([self._upper[:1], np.repeat(self._upper[1:], TICKS, axis=0)])
            self._longest = self._longest / TICKS
        self._kernels: dict[bytes, np.ndarray] = {}
        self.reached: list[np.ndarray] = []
        box = self._connected_box() if self._swept else self._whole_box()
        self.cells = None if box is None else self._fine_cells(*box)

    def _extents(self, lengths: np.ndarray) -> np.ndarray:
        """Return the longest displacement (d,) along each axis, given ``lengths`` (F,)."""
        along = np.abs(self._directions).max(axis=1) == 1
        sizes = np.abs(self._directions[along]) * lengths[along, None]
        return np.array(sizes.max(axis=0))

    def _whole_box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return a box that holds all positions, a little larger."""
        low, high = position_box(self._agent, self._game.horizon)
        room = 1e-3 * self._longest + 4 * SLACK
        return low - room, high + room

    def _connected_box(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the box of the space that is connected to the start; None if the goal is not."""
        whole = self._whole_box()
        near = self._box_of_bodies(*whole)
        if self._component(*near, self.goal, self.start, whole) is None:
            return None
        box = self._component(*near, self.start, self.goal, whole)
        for _ in range(ZOOMS):
            smaller = None if box is None else self._component(*box, self.start, self.goal, box)
            if box is None or smaller is None:
                return None
            done = np.prod(smaller[1] - smaller[0]) > 0.5 * np.prod(box[1] - box[0])
            box = smaller
            if done:
                break
        return box

    def sealed(self) -> bool:
        """Return whether the space around the start, or the goal, is bounded and lacks the other.

        It is within the workspace and outside the bodies that rest; reachable sets do not bound it.
        """
        space = (np.full(len(self.start), -np.inf), np.full(len(self.start), np.inf))
        near = self._box_of_bodies(*space)
        ends = (self.goal, self.start), (self.start, self.goal)
        return any(self._component(*near, *pair, space) is None for pair in ends)

    def _box_of_bodies(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the part of a box with start, goal, and all bodies that rest."""
        points = [self.start, self.goal]
        for body in self.bodies:
            if body.rests:
                points += [bound + body.path[0] for bound in body.collision.bounds]
        room = 0.05 * np.ptp(points, axis=0) + self._longest + 4 * SLACK
        return np.maximum(low, np.min(points, axis=0) - room), np.minimum(
            high, np.max(points, axis=0) + room
        )

    def _component(
        self,
        low: np.ndarray,
        high: np.ndarray,
        first: np.ndarray,
        other: np.ndarray,
        whole: tuple[np.ndarray, np.ndarray],
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the box of the space connected to ``first``; None if ``other`` is not in it.

        If it reaches a side of the box that is no side of the ``whole`` box, it is the whole box.
        """
        extent = high - low
        size = (extent.prod() / MOST_CELLS[len(extent)]) ** (1 / len(extent))
        cells = Cells.covering(low, high, np.minimum(extent, size))
        joined = connected(cells.near(first), ~self._blocked_always(cells))
        places = np.argwhere(joined)
        if not len(places):  # a body rests there
            return None
        least = cells.low + places.min(axis=0) * cells.size
        most = cells.low + (places.max(axis=0) + 1) * cells.size
        if ((least <= low) & (low > whole[0])).any() or ((most >= high) & (high < whole[1])).any():
            return whole
        if not (joined & cells.near(other)).any():
            return None
        return np.maximum(low, least), np.minimum(high, most)

    def _fine_cells(self, low: np.ndarray, high: np.ndarray) -> Cells:
        """Return cells of which a longest step along each axis is nearly a whole number."""
        extent, dim = high - low, self._agent.dim
        longest = np.where(self._longest > 10 * SLACK, self._longest, extent)
        steps = np.maximum(extent / longest, 1.0)
        most = (self._most / steps.prod()) ** (1 / dim)
        # Multiples of the number of parts, so that parts are nearly whole numbers as well.
        count = max((n for n in PER_STEP if n <= most), default=1)
        return Cells.around(self.start, low, high, longest / (count - SHARE))

    def _blocked_always(self, cells: Cells) -> np.ndarray:
        """Return the cells outside the workspace or inside a body that rests."""
        agent, d = self._agent, self._agent.dim
        rows = workspace_rows(agent)
        places = ~rows[:, d:].any(axis=1)
        limits = workspace_limits(agent, self._game.horizon).max(axis=0)
        blocked = cells.beyond(rows[places, :d], limits[places])
        for body in self.bodies:
            if body.rests:
                cells.block(blocked, body.collision, body.path[:1], self._rounding)
        return blocked

    def arrivals(self, stop: Callable[[], bool] | None = None) -> Iterator[int]:
        """Yield the times at which the goal may be reached, in ascending order.

        ``stop`` is asked before every step; if it says so, later times are not looked for.
        """
        if self.cells is None:
            return
        always = self._blocked_always(self.cells)
        goals, reached = self.cells.near(self.goal), self.cells.near(self.start)
        moving = [body for body in self.bodies if not body.rests]
        self.reached = [reached]
        for t in range(len(self._lengths)):
            if stop is not None and stop():
                return
            moved, reached = self._advance(self.cells, reached, always, moving, t)
            # Cells round every step up; longer spans and reachable sets do not.
            near = ~self.cells.beyond(self._directions, self._upper[t + 1])
            for span in SPANS[not moving :]:
                if span <= t + 1:
                    near &= self._within_span(self.cells, t, span)
            moved, reached = moved & near, reached & near
            self.reached.append(reached)
            if (moved & goals).any():
                yield t + 1
            if not reached.any():
                return

    def _advance(
        self, cells: Cells, reached: np.ndarray, always: np.ndarray, moving: list[Barrier], t: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return where the mean can arrive at t + 1, and where it can be in traffic then.

        Both are the free cells that are connected to those ``reached`` at t, or at instants the
        cells within a step, and the free ones of them: at its arrival, an agent is out of traffic.
        """
        first = t if self._swept else t + 1
        around = [body for body in moving if first < body.until]
        parts = _parts(around, t) if self._swept else 1
        kernel = self.kernel(cells, self._lengths[t] / parts)
        moved = reached
        for part in range(parts):
            ends = np.array([part, part + 1]) / parts if self._swept else np.zeros(1)
            free = ~self._blocked(cells, always, around, first, ends)
            moved = dilated(reached, kernel)
            reached = connected(reached, moved & free) if self._swept else moved & free
        return reached if self._swept else moved, reached

    def _blocked(
        self,
        cells: Cells,
        always: np.ndarray,
        around: Sequence[Barrier],
        t: int,
        ends: np.ndarray,
    ) -> np.ndarray:
        """Return the cells blocked from ``ends[0]`` to ``ends[-1]`` of the step from t on."""
        if not around:
            return always
        blocked = always.copy()
        for body in around:
            moves = body.path[min(t + 1, len(body.path) - 1)] - body.path[t]
            shifts = body.path[t] + ends[:, None] * moves
            cells.block(blocked, body.collision, shifts, self._rounding)
        return blocked

    def _within_span(self, cells: Cells, t: int, span: int) -> np.ndarray:
        """Return the cells within the last ``span`` steps up to t + 1 of those reached before."""
        lengths = self._lengths[t + 1 - span : t + 1].sum(axis=0)
        return dilated(self.reached[t + 1 - span], self.kernel(cells, lengths))

    def step_kernel(self, cells: Cells, t: int) -> np.ndarray:
        """Return the :meth:`kernel` of step t."""
        return self.kernel(cells, self._lengths[t])

    def longest_kernel(self, cells: Cells) -> np.ndarray:
        """Return the :meth:`kernel` of the longest step along each direction."""
        return self.kernel(cells, self._lengths.max(axis=0))

    def kernel(self, cells: Cells, lengths: np.ndarray) -> np.ndarray:
        """Return the mask of displacements between cells within ``lengths``, none in its middle.

        A displacement is included if it connects any points of the cells.
        """
        key = lengths.tobytes()
        if key not in self._kernels:
            most = np.ceil(self._extents(lengths) / cells.size)
            most = np.minimum(most, cells.shape).astype(int)
            axes = [np.arange(-m, m + 1) * h for m, h in zip(most, cells.size, strict=True)]
            moves = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1) @ self._directions.T
            room = self._rounding * (np.abs(self._directions) @ cells.size)
            self._kernels[key] = (moves <= lengths + room).all(axis=-1)
        return self._kernels[key]


def _parts(around: Sequence[Barrier], t: int) -> int:
    """Return the number of parts of step t, each too short to pass over a body."""
    most = 1.0
    for body in around:
        low, high = body.collision.bounds
        moves = np.abs(body.path[t + 1] - body.path[t])
        most = max(most, 4 * float((moves / (high - low)).max()))
    return min((count for count in PARTS if count >= most), default=max(PARTS))
