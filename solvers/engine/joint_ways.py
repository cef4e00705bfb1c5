r"""Ways of several agents at once over points of space, as in multi-agent path finding.

The search goes from configuration to configuration (one point per agent), one step of time at a
time.  The next configuration is found agent by agent: each takes the free point nearest to its goal
and asks those that stand there to make room first (priority inheritance, Okumura et al. 2022).
Where this leads nowhere, points of some agents are fixed one after the other, so that in the end
every next configuration is tried (LaCAM, Okumura 2023).  Attempts are short; later ones change the
order of the agents and send some of them on detours.  The ways say nothing about cost.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.game import Game
from solvers.engine.way_grid import WayGrid

GONE = -1
"""Point of an agent that was removed at its goal."""

GOAL = 1
"""Index of the goal among the points of an agent."""

MOST_VISITS = 150
"""Configurations that one attempt visits."""

NOISES = (0.0, 0.5, 2.0)
"""Steps by which the distances of points are disturbed, in turn from attempt to attempt."""

ROOM = 0.1
"""Part of a step by which a distance may exceed whole steps: small terms decide ties."""

DETOURED = 0.5
"""Probability that an agent makes a detour in one of the later attempts."""

Configuration = tuple[int, ...]


@dataclass
class _Node:
    """A configuration at a time, and the partial choices of the next one still to be tried."""

    points: Configuration
    time: int
    before: _Node | None
    choices: deque[tuple[tuple[int, int], ...]] = field(default_factory=lambda: deque([()]))


class JointWays:
    """The search for ways of ``movers`` over their ``grids``; agents are numbered in this order."""

    def __init__(self, game: Game, movers: tuple[int, ...], grids: list[WayGrid]) -> None:
        self._grids, self._horizon = grids, game.horizon
        self._moving = any(grid.moving for grid in grids)
        self._swept, self._stays = game.collisions == "swept", game.on_goal == "stay"
        numbers = {i: k for k, i in enumerate(movers)}
        self._pairs = {}
        for encounter in game.encounters:
            if encounter.obstacle is None and set(encounter.agents) <= set(movers):
                i, j = (numbers[a] for a in encounter.agents)
                normals, offsets = encounter.collision.faces
                places = [(self._grids[k].points @ normals.T).tolist() for k in (i, j)]
                self._pairs[i, j] = (*places, (offsets - tol.LENGTH).tolist())
        self._faces: dict[tuple[int, int, int, int], int] = {}
        self._after: dict[tuple[int, int, int], list[int]] = {}

    def find(self, attempt: int) -> list[np.ndarray] | None:
        """Return ways (T_i + 1, d) of all agents that end at their goals; None if none is found.

        The first attempts go straight to the goals.  In the others, drawn from the number of the
        attempt, some agents make for a point drawn at random until a time drawn at random.
        """
        self._draw(attempt)
        count = len(self._grids)
        start = tuple(0 for _ in range(count))
        stack = [_Node(start, 0, None)]
        visited = {self._key(start, 0): 0}
        for _ in range(MOST_VISITS):
            if not stack:
                return None
            node = stack[-1]
            if all(point in (GONE, GOAL) for point in node.points):
                return self._ways(node)
            if not node.choices or not self._in_time(node):
                stack.pop()
                continue
            choice = node.choices.popleft()
            order = self._order(node)
            self._branch(node, choice, order)
            points, time = self._next(node, choice, order), node.time + 1
            if points is None or visited.get(self._key(points, time), self._horizon + 1) <= time:
                continue
            visited[self._key(points, time)] = time
            stack.append(_Node(points, time, node))
        return None

    def _draw(self, attempt: int) -> None:
        """Draw the detours of an attempt, and how much the order of points is disturbed."""
        random = self._random = np.random.default_rng(attempt)
        self._noise = NOISES[attempt % len(NOISES)]
        self._detours = {}
        self._ranked = sorted(range(len(self._grids)), key=lambda k: -self._grids[k].left[0, 0])
        if attempt < len(NOISES):
            return
        random.shuffle(self._ranked)
        for k, grid in enumerate(self._grids):
            if random.random() < DETOURED:
                spare = self._horizon - float(grid.left[0, 0])
                until = int(random.uniform(1, max(2.0, spare)))
                via = int(random.integers(len(grid.points)))
                if grid.left[0, via] < np.inf:
                    self._detours[k] = until, grid.times_to(via)

    def _key(self, points: Configuration, time: int) -> tuple[int, ...]:
        """Return what makes a configuration new: the time as well where bodies move."""
        return (*points, time) if self._moving or self._detours else points

    def _left(self, node: _Node, k: int) -> float:
        """Return the number of steps that agent ``k`` is from its goal."""
        return float(self._grids[k].left[node.time, node.points[k]])

    def _in_time(self, node: _Node) -> bool:
        """Return whether each agent alone can still arrive in time."""
        on_way = [k for k, p in enumerate(node.points) if p not in (GONE, GOAL)]
        steps = max((max(1.0, np.ceil(self._left(node, k) - ROOM)) for k in on_way), default=0.0)
        return bool(node.time + steps <= self._horizon)

    def _order(self, node: _Node) -> list[int]:
        """Return the agents on their way in the order in which they choose."""
        return [k for k in self._ranked if node.points[k] not in (GONE, GOAL)]

    def _branch(self, node: _Node, choice: tuple[tuple[int, int], ...], order: list[int]) -> None:
        """Queue the choices that fix the point of one more agent."""
        if len(choice) < len(order):
            k = order[len(choice)]
            for point in self._targets(node, k):
                node.choices.append((*choice, (k, point)))

    def _next(
        self, node: _Node, choice: tuple[tuple[int, int], ...], order: list[int]
    ) -> Configuration | None:
        """Return a next configuration with the points of ``choice``; None if none is found."""
        after = [GONE] * len(node.points)
        decided = [p == GONE for p in node.points]
        for k, p in enumerate(node.points):
            if p == GOAL:
                decided[k] = True
                after[k] = GOAL if self._stays else GONE
        for k, point in choice:
            if not self._may(node, k, point, after, decided):
                return None
            after[k], decided[k] = point, True
        for k in order:
            if not decided[k] and not self._move(node, k, after, decided):
                return None
        return tuple(after)

    def _move(self, node: _Node, k: int, after: list[int], decided: list[bool]) -> bool:
        """Decide where agent ``k`` goes, after those that have to make room for it."""
        targets = self._targets(node, k)
        before = list(after), list(decided)
        for point in targets:
            if not self._may(node, k, point, after, decided):
                continue
            after[k], decided[k] = point, True
            blocked = [
                j
                for j, p in enumerate(node.points)
                if not decided[j] and not self._apart(node, k, point, j, p)
            ]
            if all(decided[j] or self._move(node, j, after, decided) for j in blocked):
                return True
            after[:], decided[:] = before
        return False

    def _targets(self, node: _Node, k: int) -> list[int]:
        """Return where agent ``k`` can go past bodies that move, the best points first."""
        grid, t, point = self._grids[k], node.time, node.points[k]
        until, left = self._detours.get(k, (0, grid.left[t + 1]))
        plain = self._noise == 0 and t >= until
        key = k, t if grid.moving else 0, point
        if plain and key in self._after:
            return self._after[key]
        targets = grid.after[point]
        keep = grid.left[t + 1, targets] < np.inf
        for body in grid.moving:
            sources = np.full(len(targets), point)
            keep &= body.passed(t, sources, targets, targets == GOAL)
        targets = targets[keep]
        keys = (grid.left[t + 1] if t >= until else left)[targets]
        if self._noise:
            keys = keys + self._noise * self._random.random(len(targets))
        result = targets[np.argsort(keys, kind="stable")].tolist()
        if plain:
            self._after[key] = result
        return result

    def _may(self, node: _Node, k: int, point: int, after: list[int], decided: list[bool]) -> bool:
        """Return whether ``k`` can go to ``point`` past the agents that are decided."""
        return all(
            j == k or not known or self._apart(node, k, point, j, after[j])
            for j, known in enumerate(decided)
        )

    def _apart(self, node: _Node, k: int, point: int, j: int, other: int) -> bool:
        """Return whether agents ``k`` and ``j`` keep apart on their steps to points."""
        before, after = (node.points[k], node.points[j]), (point, other)
        if GONE in before or j == k:
            return True
        i, m, flip = (k, j, 1) if k < j else (j, k, -1)
        then = 0 if GONE in after else self._clear(i, m, *after[::flip])
        if not self._swept:
            return bool(then) or (not self._stays and GOAL in after) or GONE in after
        if GONE in after:
            return True
        return bool(self._clear(i, m, *before[::flip]) & then)

    def _clear(self, i: int, j: int, one: int, other: int) -> int:
        """Return the faces of a pair that are clear at two points, as bits."""
        key = i, j, one, other
        if key not in self._faces:
            first, second, offsets = self._pairs[i, j]
            rows = zip(first[one], second[other], offsets, strict=True)
            self._faces[key] = _bits(a - b >= c for a, b, c in rows)
        return self._faces[key]

    def _ways(self, node: _Node) -> list[np.ndarray]:
        """Return the ways of all agents to a last configuration."""
        nodes = []
        last: _Node | None = node
        while last is not None:
            nodes.append(last)
            last = last.before
        ways = []
        for k, grid in enumerate(self._grids):
            points = [n.points[k] for n in reversed(nodes)]
            end = points.index(GOAL)
            ways.append(grid.points[points[: end + 1]])
        return ways


def _bits(values: Iterable[bool]) -> int:
    return sum(1 << n for n, value in enumerate(values) if value)
