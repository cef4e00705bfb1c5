"""Bodies that one agent keeps apart from, on paths that are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan
from ppg_env.game.polytope import Polytope


@dataclass(frozen=True)
class Barrier:
    """A body that an agent keeps apart from: its collision set around ``path`` (H+1, d).

    It counts during events before ``until``.
    """

    collision: Polytope
    path: np.ndarray
    until: int

    @cached_property
    def rests(self) -> bool:
        """Whether the body is where it is at all times."""
        return self.until >= len(self.path) - 1 and not (self.path - self.path[0]).any()

    def slowed(self, parts: int) -> Barrier:
        """Return the body with times that count ``parts`` of a step."""
        last = len(self.path) - 1
        times = np.linspace(0, last, parts * last + 1)
        columns = [np.interp(times, np.arange(last + 1), column) for column in self.path.T]
        return Barrier(self.collision, np.array(columns).T, parts * self.until)

    def meets(self, low: np.ndarray, high: np.ndarray) -> bool:
        """Return whether the body can keep a position in a box from being taken, at some time."""
        least, most = self.collision.bounds
        return bool(((self.path + least < high) & (self.path + most > low)).all(axis=1).any())


def barriers(game: Game, agent: int, given: Mapping[int, Plan]) -> list[Barrier]:
    """Return the obstacles, the agents of ``given``, and agents that stay at their start."""
    result = []
    for encounter in game.encounters:
        if agent not in encounter.agents:
            continue
        collision, always = encounter.collision, game.horizon + 1
        if encounter.obstacle is not None:
            obstacle = game.obstacles[encounter.obstacle]
            until = always if obstacle.until is None else obstacle.until
            result.append(Barrier(collision, obstacle.positions(game.horizon), until))
            continue
        (j,) = (k for k in encounter.agents if k != agent)
        if j == encounter.agents[0]:
            collision = Polytope.from_vertices(-collision.vertices)
        if j in given:
            path, arrival = given[j].means[:, : game.dim], given[j].arrival
            leaves = arrival is not None and game.on_goal == "remove"
            result.append(Barrier(collision, path, int(arrival or 0) if leaves else always))
        elif game.on_goal == "stay" and starts_at_goal(game.agents[j]):
            path = np.tile(game.agents[j].start[: game.dim], (game.horizon + 1, 1))
            result.append(Barrier(collision, path, always))
    return result


def starts_at_goal(agent: Agent) -> bool:
    """Return whether an agent has arrived at time 0, whatever it plans."""
    return bool(np.abs(agent.start[: agent.goal.size] - agent.goal).max() <= tol.LENGTH)
