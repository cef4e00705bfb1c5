"""Bodies that an agent can hit and does not observe: obstacles, and players that follow plans.

At time t a body is at p_t ~ N(path_t, spread_t), and p_{t+1} = carry p_t + noise about its path.
Where the spread is zero, the agent knows where the body is.  Otherwise its position at the end of
each step counts as if it were independent of the steps before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppg_env.env.players import Player, Tracker
from ppg_env.errors import InputError
from ppg_env.game.dynamics import covariances
from ppg_env.game.game import Game
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.plan import Plan
from ppg_env.game.polytope import Polytope, collision_set
from solvers.feedback.grid.event_table import Hazard


@dataclass(frozen=True, eq=False)
class FrozenBody:
    """A body that an agent can hit.

    Attributes
    ----------
    collision : displacements of the agent from the body at which they overlap.
    path : (T+1, d) mean positions at times 0, 1, ..., of which the last holds without end.
    spread : (T+1, d, d) covariances of the position.
    between : (T, d, d) covariances of the positions at t+1 and t.
    until : time from which the body is gone; None if it stays.
    moves : whether it may move, or leave.
    """

    collision: Polytope
    path: np.ndarray
    spread: np.ndarray
    between: np.ndarray
    until: int | None
    moves: bool = True

    def hazard(self, clock: int, *, swept: bool) -> Hazard | None:
        """Return what the agent can hit in the step from ``clock``; None if it is gone."""
        if self.until is not None and (clock if swept else clock + 1) >= self.until:
            return None
        last = len(self.path) - 1
        now, then = min(clock, last), min(clock + 1, last)
        spread, carry = self.spread[now], np.eye(len(self.spread[now]))
        if now < then:
            carry = self.between[now] @ np.linalg.pinv(spread)
        noise = self.spread[then] - carry @ spread @ carry.T
        return Hazard(self.collision, self.path[now], self.path[then], spread, carry, noise)


def frozen_bodies(game: Game, agent: int, followed: Mapping[int, Plan]) -> list[FrozenBody]:
    """Return the obstacles, and the agents that follow plans, that ``agent`` can hit."""
    bodies = [
        _obstacle(game.obstacles[e.obstacle], e.collision)
        for e in game.encounters
        if e.obstacle is not None and e.agents[0] == agent
    ]
    shape = game.agents[agent].shape
    for j, plan in sorted(followed.items()):
        bodies.append(_agent(game, j, plan, collision_set(shape, game.agents[j].shape)))
    return bodies


def followed_plans(players: Mapping[int, Player]) -> dict[int, Plan]:
    """Return the plans that ``players``, by the numbers of their agents, follow.

    Raises
    ------
    InputError
        If one of them does not track a plan.
    """
    plans: dict[int, Plan] = {}
    for j, player in players.items():
        if not isinstance(player, Tracker):
            raise InputError(
                f"players[{j}]", "follows no plan",
                "give plans that are tracked, or two agents of two state components each",
            )  # fmt: skip
        plans[j] = player.plan
    return plans


def epochs(bodies: Sequence[FrozenBody], steps: int) -> int:
    """Return the number of first steps in which bodies differ; the last one stands for more."""
    moving = [max(len(body.path), (body.until or 0) + 1) for body in bodies if body.moves]
    return min(max(moving, default=1), steps)


def _obstacle(obstacle: Obstacle, collision: Polytope) -> FrozenBody:
    """Return an obstacle, whose drift is a sum of independent steps."""
    rest, moves = obstacle.rest, obstacle.path is not None
    path = obstacle.positions(rest)
    spread = obstacle.covariances(rest)
    return FrozenBody(collision, path, spread, spread[:rest], obstacle.until, moves)


def _agent(game: Game, agent: int, plan: Plan, collision: Polytope) -> FrozenBody:
    """Return an agent that leaves when its plan arrives."""
    mover, d = game.agents[agent], game.dim
    spread = covariances(mover, game.horizon)
    between = (mover.closed_loop @ spread[:-1])[:, :d, :d]
    return FrozenBody(collision, plan.means[:, :d], spread[:, :d, :d], between, plan.arrival)
