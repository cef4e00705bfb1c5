"""Tiny games by enumeration: a linear program for every choice of arrivals and faces.

Written with plain lists and ``scipy.optimize.linprog``; collision sets and covariances are those
of :mod:`tests.oracles.slow_evaluator`.  Games of one encounter and of the objective ``margin``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from math import inf, sqrt

import numpy as np
from scipy.optimize import linprog

from ppg_env import Game, Plan
from tests.oracles.slow_evaluator import (
    body_of_obstacle,
    faces_of_sum,
    spread_over_time,
)


def enumerated_optimum(
    game: Game,
    time: Sequence[float],
    weight: float,
    effort: Sequence[float],
    given: Mapping[int, Plan] | None = None,
) -> float:
    """Least time . T + weight x deficit + effort . sum |u| over the plans that are not given."""
    given = given or {}
    movers = [i for i in range(len(game.agents)) if i not in given]
    best = inf
    for ends in product(range(game.horizon + 1), repeat=len(movers)):
        arrival = {i: plan.arrival for i, plan in given.items()} | dict(
            zip(movers, ends, strict=True)
        )
        case = _Case(game, arrival, given, weight, effort)
        spent = sum(time[i] * arrival[i] for i in movers)
        if spent + case.least([]) >= best:
            continue
        for faces in product(case.faces, repeat=case.events):
            best = min(best, spent + case.least(faces))
    return best


class _Case:
    """The linear programs of one vector of arrivals; columns are controls, sizes and margins."""

    def __init__(self, game, arrival, given, weight, effort):
        self.game, self.arrival, self.weight = game, arrival, weight
        self.instants = (0, 1) if game.collisions == "swept" else (0,)
        bodies = [agent.shape.vertices for agent in game.agents]
        ends, last = list(arrival.values()), game.horizon + (game.collisions == "instants")
        until = inf
        if game.obstacles:
            self.wall = body_of_obstacle(game, game.obstacles[0])
            bodies.append(self.wall.shape)
            until = self.wall.until
            if game.on_goal == "stay":
                ends.append(self.wall.rest)
        end = max(ends) if game.on_goal == "stay" else min(ends)
        self.events = int(min(end, until, last))
        self.faces = faces_of_sum(bodies[1], -bodies[0])
        self.width = sum(2 * game.horizon * a.control_dim for a in game.agents) + self.events
        self.cost = np.zeros(self.width)
        self.cost[self.width - self.events :] = -weight
        self.low, self.high = np.full(self.width, -inf), np.full(self.width, inf)
        self.low[self.width - self.events :] = 0
        self.high[self.width - self.events :] = game.margin_cap
        self.rows, self.limits, self.equal, self.values = [], [], [], []
        self.places, self.spreads, first = [], [], 0
        for i, agent in enumerate(game.agents):
            first = self._add_agent(agent, arrival[i], effort[i], given.get(i), first)

    def _add_agent(self, agent, end, effort, plan, first):
        """Columns u_t and |u_t| from ``first`` on, and the states as rows and constants."""
        m, horizon = agent.control_dim, self.game.horizon
        after = first + 2 * horizon * m
        states = [(np.zeros((agent.state_dim, self.width)), np.array(agent.start))]
        for t in range(horizon):
            u = np.arange(first + t * m, first + (t + 1) * m)
            size = u + horizon * m
            self.cost[size] = effort if plan is None else 0.0
            matrix, constant = states[-1]
            if t >= end:
                self.low[u] = self.high[u] = self.low[size] = self.high[size] = 0
                states.append((matrix, constant))
                continue
            push = np.zeros((m, self.width))
            push[:, u] = np.eye(m)
            states.append((agent.A @ matrix + agent.B @ push, agent.A @ constant))
            for sign in (1, -1):
                self._below(sign * push - _unit_rows(size, self.width), np.zeros(m))
            if plan is not None:
                self.low[u] = self.high[u] = plan.controls[t]
                continue
            normals, offsets = agent.control_at(t).faces
            room = [-feedback_room(agent, t, normal) for normal in normals]
            self._below(normals @ push, offsets + room)
        matrix, constant = states[end]
        g = len(agent.goal)
        if plan is None:
            self.equal.append(matrix[:g])
            self.values.append(agent.goal - constant[:g])
            self._keep_within(agent, states[: end + 1])
        spreads = [s[: agent.dim, : agent.dim] for s in spread_over_time(agent, horizon)]
        if self.game.on_goal == "stay":
            spreads = [spreads[min(t, end)] for t in range(horizon + 1)]
        self.places.append([(matrix[: agent.dim], place[: agent.dim]) for matrix, place in states])
        self.spreads.append(spreads)
        return after

    def _keep_within(self, agent, states):
        spreads = spread_over_time(agent, len(states))
        for region in agent.within:
            k = region.dim
            for (matrix, constant), spread in zip(states, spreads, strict=False):
                along = np.einsum("ri,ij,rj->r", region.normals, spread[:k, :k], region.normals)
                room = region.offsets - region.sigmas * np.sqrt(along)
                self._below(region.normals @ matrix[:k], room - region.normals @ constant[:k])

    def _below(self, rows, limits):
        self.rows.append(rows)
        self.limits.append(limits)

    def least(self, faces) -> float:
        """Least cost with these faces, one per event; without any, a lower bound."""
        rows, limits = list(self.rows), list(self.limits)
        for t, (normal, offset) in enumerate(faces):
            for k in self.instants:
                matrix, place, spread = self._apart(t + k)
                unit = sqrt(2 * max(normal @ spread @ normal, 0.0))
                row = -(normal @ matrix)
                row[self.width - self.events + t] = unit
                rows.append(row[None])
                limits.append([normal @ place - offset])
        answer = linprog(
            self.cost,
            A_ub=np.vstack(rows) if rows else None,
            b_ub=np.concatenate(limits) if rows else None,
            A_eq=np.vstack(self.equal) if self.equal else None,
            b_eq=np.concatenate(self.values) if self.equal else None,
            bounds=np.column_stack([self.low, self.high]),
        )
        if answer.status == 2:
            return inf
        assert answer.status == 0
        return answer.fun + self.weight * self.events * self.game.margin_cap

    def _apart(self, t):
        """Displacement of the two bodies at ``t``, as rows and a constant, and its covariance."""
        (matrix, place), spread = self.places[0][t], self.spreads[0][t]
        if self.game.obstacles:
            return matrix, place - self.wall.places[t], spread + self.wall.spreads[t]
        other, there = self.places[1][t]
        return matrix - other, place - there, spread + self.spreads[1][t]


def feedback_room(agent, t, normal) -> float:
    """What feedback asks of a face of the control set at step ``t``."""
    asked = agent.gain @ spread_over_time(agent, t)[t] @ agent.gain.T
    return agent.reserve * sqrt(max(normal @ asked @ normal, 0.0))


def _unit_rows(columns, width):
    rows = np.zeros((len(columns), width))
    rows[np.arange(len(columns)), columns] = 1
    return rows
