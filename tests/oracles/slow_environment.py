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


def nearest(point: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Nearest point of conv(vertices): non-negative weights, their sum held at 1 by its weight."""
    heavy = 1e4 * np.ones((1, len(vertices)))
    weights, _ = nnls(np.vstack([vertices.T, heavy]), np.append(point, 1e4))
    return weights @ vertices


@dataclass
class SlowGame:
    """One copy of ``game`` under ``rules``."""

    game: Game
    rules: Rules
    time: int = 0
    states: list[np.ndarray] = field(default_factory=list)
    place: list[str] = field(default_factory=list)  # "traffic", "arrived" or "crashed"
    alive: list[bool] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.states = [agent.start.copy() for agent in self.game.agents]
        self.place = ["arrived" if self.at_goal(i) else "traffic" for i in range(len(self.states))]
        self.alive = [True for _ in self.states]

    def at_goal(self, i: int) -> bool:
        if self.rules.schedule is not None:
            return self.time >= self.rules.schedule[i]
        goal = self.game.agents[i].goal
        return bool(np.abs(self.states[i][: goal.size] - goal).max() <= self.rules.tolerance)

    def bodies(self) -> list[tuple[int, int | None, np.ndarray, np.ndarray]]:
        """All pairs that may meet: i, j or None, displacement, vertices of the collision set."""
        d = self.game.dim
        pairs: list[tuple[int, int | None, np.ndarray, np.ndarray]] = []
        for i, one in enumerate(self.game.agents):
            for j in range(i + 1, len(self.game.agents)):
                away = self.states[i][:d] - self.states[j][:d]
                other = self.game.agents[j].shape.vertices
                sums = (other[:, None] - one.shape.vertices[None]).reshape(-1, d)
                pairs.append((i, j, away, sums))
        for i, one in enumerate(self.game.agents):
            for obstacle in self.game.obstacles:
                sums = (obstacle.shape.vertices[:, None] - one.shape.vertices[None]).reshape(-1, d)
                pairs.append((i, None, self.states[i][:d], sums))
        return pairs

    def step(self, actions: np.ndarray, noise: np.ndarray, roots: np.ndarray) -> Outcome:
        game, rules, agents = self.game, self.rules, self.game.agents
        cost = np.zeros(len(agents))
        for i, agent in enumerate(agents):
            if self.place[i] == "traffic":
                cost[i] += agent.lam
        if rules.reward == "margin":
            cost += self.missing_margins()
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
            self.states[i] = (
                agent.A @ self.states[i] + agent.B @ u + roots[i, :n, :n] @ noise[i, :n]
            )
            if self.at_goal(i):
                self.place[i], arrived[i] = "arrived", True
        crashed = [False] * len(agents)
        for i, j, away, vertices in self.bodies():
            solid = ["traffic", "arrived"] if rules.on_goal == "stay" else ["traffic"]
            if j is None:
                meet = self.place[i] == "traffic"
            else:
                meet = self.place[i] in solid and self.place[j] in solid
                meet = meet and "traffic" in (self.place[i], self.place[j])
            if meet and inside(away, vertices):
                crashed[i] = True
                if j is not None:
                    crashed[j] = True
        for i, agent in enumerate(agents):
            if crashed[i]:
                if rules.reward == "risk":
                    cost[i] += (1 - agent.lam) * game.crash_cost
                if rules.on_crash == "remove":
                    self.place[i] = "crashed"
        return self.settle(cost, arrived, crashed)

    def settle(self, cost: np.ndarray, arrived: list[bool], crashed: list[bool]) -> Outcome:
        count, rules = len(self.place), self.rules
        no_agent_left = "traffic" not in self.place
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

    def missing_margins(self) -> np.ndarray:
        from scipy.spatial import ConvexHull

        game, cost = self.game, np.zeros(len(self.place))
        t = min(self.time, game.horizon)
        spread = [covariances(a, game.horizon)[t][: game.dim, : game.dim] for a in game.agents]
        for i, j, away, vertices in self.bodies():
            parties = [i] if j is None else [i, j]
            if any(self.place[k] != "traffic" for k in parties):
                continue
            total = sum(spread[k] for k in parties)
            best = -np.inf
            for *normal, offset in ConvexHull(vertices).equations:
                clear = np.dot(normal, away) + offset
                deviation = np.sqrt(max(np.dot(normal, total @ np.array(normal)), 0.0))
                if deviation > 1e-12:
                    best = max(best, clear / (np.sqrt(2) * deviation))
                elif clear >= -1e-6:
                    best = np.inf
            for k in parties:
                cost[k] += (1 - game.agents[k].lam) * (game.margin_cap - min(best, game.margin_cap))
        return cost
