"""The rules of play written a second time, for one copy, in plain loops: the oracle."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linprog, nnls

from ppg_env import Game
from ppg_env.env.rules import Rules
from ppg_env.game.dynamics import covariances


@dataclass
class Outcome:
    reward: list[float]
    terminated: list[bool]
    truncated: list[bool]
    arrived: list[bool]
    crashed: list[bool]


def inside(point: np.ndarray, vertices: np.ndarray) -> bool:
    """Whether a point is a convex combination of vertices, by a linear program."""
    answer = linprog(
        np.zeros(len(vertices)),
        A_eq=np.vstack([vertices.T, np.ones(len(vertices))]),
        b_eq=np.append(point, 1.0),
        bounds=(0, None),
    )
    return answer.status == 0


def meets(before: np.ndarray, after: np.ndarray, vertices: np.ndarray) -> bool:
    """Whether a segment meets conv(vertices), by a linear program: weights, and a place on it."""
    count, move = len(vertices), after - before
    answer = linprog(
        np.zeros(count + 1),
        A_eq=np.block([[vertices.T, -move[:, None]], [np.ones((1, count)), np.zeros((1, 1))]]),
        b_eq=np.append(before, 1.0),
        bounds=[(0, None)] * count + [(0, 1)],
    )
    return answer.status == 0


def nearest(point: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Nearest point of conv(vertices): non-negative weights, their sum held at 1 by its weight."""
    heavy = 1e4 * np.ones((1, len(vertices)))
    weights, _ = nnls(np.vstack([vertices.T, heavy]), np.append(point, 1e4))
    return weights @ vertices


@dataclass
class SlowGame:
    """One copy of ``game`` under ``rules``, with ``tolerance`` (N, n) of arrival regions."""

    game: Game
    rules: Rules
    tolerance: np.ndarray
    time: int = 0
    states: list[np.ndarray] = field(default_factory=list)
    place: list[str] = field(default_factory=list)  # "traffic", "arrived" or "crashed"
    alive: list[bool] = field(default_factory=list)
    walls: list[np.ndarray] = field(default_factory=list)  # positions of the obstacles
    since: list[int] = field(default_factory=list)  # times of arrival

    def __post_init__(self) -> None:
        self.states = [agent.start.copy() for agent in self.game.agents]
        self.walls = [obstacle.positions(0)[0].copy() for obstacle in self.game.obstacles]
        self.since = [10**9 for _ in self.states]
        self.place = ["arrived" if self.at_goal(i) else "traffic" for i in range(len(self.states))]
        self.alive = [True for _ in self.states]

    def at_goal(self, i: int) -> bool:
        if self.rules.schedule is not None:
            return self.time >= self.rules.schedule[i]
        goal = self.game.agents[i].goal
        away = np.abs(self.states[i][: goal.size] - goal)
        return bool((away <= self.tolerance[i, : goal.size]).all())

    def bodies(self) -> list[tuple[int, int | None, int | None, np.ndarray, np.ndarray]]:
        """All pairs that may meet: i, j or None, obstacle, displacement, vertices of the set."""
        d = self.game.dim
        pairs: list[tuple[int, int | None, int | None, np.ndarray, np.ndarray]] = []
        for i, one in enumerate(self.game.agents):
            for j in range(i + 1, len(self.game.agents)):
                away = self.states[i][:d] - self.states[j][:d]
                other = self.game.agents[j].shape.vertices
                sums = (other[:, None] - one.shape.vertices[None]).reshape(-1, d)
                pairs.append((i, j, None, away, sums))
        for i, one in enumerate(self.game.agents):
            for k, obstacle in enumerate(self.game.obstacles):
                sums = (obstacle.shape.vertices[:, None] - one.shape.vertices[None]).reshape(-1, d)
                pairs.append((i, None, k, self.states[i][:d] - self.walls[k], sums))
        return pairs

    def counts(self, i: int, j: int | None, k: int | None, place: list[str], time: int) -> bool:
        """Whether two bodies are in traffic in the event at ``time``, agents being at ``place``."""
        stay = self.rules.on_goal == "stay"
        solid = ["traffic", "arrived"] if stay else ["traffic"]
        if k is None:
            assert j is not None
            both = place[i] in solid and place[j] in solid
            return both and "traffic" in (place[i], place[j])
        obstacle = self.game.obstacles[k]
        if obstacle.until is not None and time >= obstacle.until:
            return False
        moves = stay and time < obstacle.rest
        return place[i] == "traffic" or (moves and place[i] == "arrived")

    def step(self, actions: np.ndarray, noise: np.ndarray, roots: np.ndarray) -> Outcome:
        game, rules, agents = self.game, self.rules, self.game.agents
        swept = game.collisions == "swept"
        cost, place = np.zeros(len(agents)), list(self.place)
        before = self.bodies()
        if rules.reward == "margin" and not swept:
            cost += self.missing_margins(before, before, place)
        self.time += 1
        arrived = [False] * len(agents)
        for i, agent in enumerate(agents):
            if self.place[i] != "traffic":
                continue
            n, m = agent.state_dim, agent.control_dim
            u = actions[i, :m]
            control = agent.control_at(self.time - 1)  # the clock has gone on already
            if rules.saturation == "clip" and (control.clearance(u) > 0):
                u = nearest(u, control.vertices)
            cost[i] += agent.lam + agent.effort * np.abs(u).sum()
            self.states[i] = (
                agent.A @ self.states[i] + agent.B @ u + roots[i, :n, :n] @ noise[i, :n]
            )
            if self.at_goal(i):
                self.place[i], arrived[i], self.since[i] = "arrived", True, self.time
        self.move_walls(noise, roots)
        after = self.bodies()
        if rules.reward == "margin" and swept:
            cost += self.missing_margins(before, after, place)
        crashed = [False] * len(agents)
        for (i, j, k, start, vertices), (*_, end, _vertices) in zip(before, after, strict=True):
            if swept:
                hit = self.counts(i, j, k, place, self.time - 1) and meets(start, end, vertices)
            else:
                hit = self.counts(i, j, k, self.place, self.time) and inside(end, vertices)
            if hit:
                crashed[i] = True
                if j is not None:
                    crashed[j] = True
        for i, agent in enumerate(agents):
            if crashed[i]:
                if rules.reward == "risk":
                    cost[i] += (1 - agent.lam) * game.crash_cost
                if rules.on_crash == "remove":
                    self.place[i] = "crashed"
                    arrived[i] = arrived[i] and not swept
        return self.settle(cost, arrived, crashed)

    def move_walls(self, noise: np.ndarray, roots: np.ndarray) -> None:
        row, d = len(self.states), self.game.dim
        for k, obstacle in enumerate(self.game.obstacles):
            if obstacle.path is None:
                continue
            if self.time <= obstacle.rest:
                self.walls[k] += obstacle.path[self.time] - obstacle.path[self.time - 1]
                if obstacle.noise.any():
                    self.walls[k] += roots[row, :d, :d] @ noise[row, :d]
            row += 1

    def settle(self, cost: np.ndarray, arrived: list[bool], crashed: list[bool]) -> Outcome:
        count, rules = len(self.place), self.rules
        no_agent_left = "traffic" not in self.place
        if rules.on_goal == "stay" and "arrived" in self.place:
            ends = [(o.rest, o.rest if o.until is None else o.until) for o in self.game.obstacles]
            no_agent_left = no_agent_left and all(self.time >= min(end) for end in ends)
        late = self.time >= rules.steps(self.game)
        out = Outcome([0.0] * count, [False] * count, [False] * count, arrived, crashed)
        for i in range(count):
            if not self.alive[i]:
                continue
            out.reward[i] = -float(cost.sum() if rules.sharing == "social" else cost[i])
            left = self.place[i] == "crashed"
            left = left or (self.place[i] == "arrived" and rules.on_goal == "remove")
            out.terminated[i] = no_agent_left or (left and rules.sharing == "selfish")
            out.truncated[i] = late and not out.terminated[i]
            self.alive[i] = not (out.terminated[i] or out.truncated[i])
        return out

    def missing_margins(self, before: list, after: list, place: list[str]) -> np.ndarray:
        """What margins cost in the event that began with ``before``, agents being at ``place``."""
        from scipy.spatial import ConvexHull

        game, cost = self.game, np.zeros(len(self.place))
        swept = game.collisions == "swept"
        time = self.time - swept
        for (i, j, k, *start), (_i, _j, _k, end, _vertices) in zip(before, after, strict=True):
            if not self.counts(i, j, k, place, time):
                continue
            best = -np.inf
            for *normal, offset in ConvexHull(start[1]).equations:
                ends = [(start[0], time), (end, time + 1)][: 1 + swept]
                best = max(
                    best, min(self.margin(i, j, k, np.array(normal), offset, *e) for e in ends)
                )
            for a in [i] if j is None else [i, j]:
                cost[a] += (1 - game.agents[a].lam) * (game.margin_cap - min(best, game.margin_cap))
        return cost

    def margin(
        self, i: int, j: int | None, k: int | None, normal: np.ndarray, offset: float,
        away: np.ndarray, time: int,
    ) -> float:  # fmt: skip
        """The margin of one face; a parked body keeps the covariance of its arrival."""
        game, stay = self.game, self.rules.on_goal == "stay"
        total = np.zeros((game.dim, game.dim))
        for a in [i] if j is None else [i, j]:
            t = min(time, game.horizon, self.since[a] if stay else time)
            total += covariances(game.agents[a], game.horizon)[t][: game.dim, : game.dim]
        if k is not None:
            total += game.obstacles[k].covariances(game.horizon)[min(time, game.horizon)]
        clear = np.dot(normal, away) + offset
        deviation = np.sqrt(max(np.dot(normal, total @ normal), 0.0))
        if deviation > 1e-12:
            return clear / (np.sqrt(2) * deviation)
        return np.inf if clear >= -1e-6 else -np.inf
