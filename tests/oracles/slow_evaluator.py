"""The evaluator once more, in plain loops and straight from section 2 of the design.

Shares no code with :mod:`ppg_env`: faces of K come from the edges of both bodies (plane only),
covariances from the recursion, arrivals from the means.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import erfc, inf, sqrt

import numpy as np

from ppg_env import Agent, Game

Face = tuple[np.ndarray, float]


@dataclass
class Judgement:
    arrival: list[int | None]
    safety_cost: list[float]
    deficit: list[float]
    risk: list[float]
    cost: list[float]
    shifted_cost: list[float]
    potential: float


def slow_evaluation(game: Game, controls: list[np.ndarray]) -> Judgement:
    count, cap, steps = len(game.agents), game.margin_cap, range(game.horizon + 1)
    means, arrival = [], []
    for agent, rows in zip(game.agents, controls, strict=True):
        states = [np.array(agent.start)]
        for row in rows:
            states.append(agent.A @ states[-1] + agent.B @ row)
        misses = [np.abs(x[: len(agent.goal)] - agent.goal).max() for x in states]
        arrival.append(next((t for t, miss in enumerate(misses) if miss <= 1e-6), None))
        means.append(states)
    spreads = [spread_over_time(agent, game.horizon) for agent in game.agents]
    end = [inf if t is None else t for t in arrival]

    safety, deficit, risk, losses = ([0.0] * count for _ in range(4))
    potential = 0.0

    def count_in(margin: float, parties: list[int], traffic: bool) -> None:
        nonlocal potential
        danger = erfc(margin) / 2 if traffic else 0.0
        loss = cap - margin if game.objective == "margin" else game.crash_cost * danger
        loss = loss if traffic else 0.0
        potential += loss
        for i in parties:
            safety[i] -= margin
            deficit[i] += cap - margin
            risk[i] += danger
            losses[i] += loss

    for i in range(count):
        one = game.agents[i]
        for j in range(i + 1, count):
            faces = faces_of_sum(game.agents[j].shape.vertices, -one.shape.vertices)
            for t in steps:
                apart = means[i][t][: game.dim] - means[j][t][: game.dim]
                spread = spreads[i][t] + spreads[j][t]
                traffic = t < end[i] and t < end[j]
                margin = margin_of(game, faces, apart, spread) if traffic else cap
                count_in(margin, [i, j], traffic)
        for obstacle in game.obstacles:
            faces = faces_of_sum(obstacle.shape.vertices, -one.shape.vertices)
            for t in steps:
                traffic = t < end[i]
                margin = (
                    margin_of(game, faces, means[i][t][: game.dim], spreads[i][t])
                    if traffic
                    else cap
                )
                count_in(margin, [i], traffic)

    cost, shifted = [], []
    for i, agent in enumerate(game.agents):
        shifted.append(agent.lam * end[i] + (1 - agent.lam) * losses[i])
        paper = safety[i] if game.objective == "margin" else losses[i]
        cost.append(agent.lam * end[i] + (1 - agent.lam) * paper)
        potential += agent.lam / (1 - agent.lam) * end[i]
    return Judgement(arrival, safety, deficit, risk, cost, shifted, potential)


def spread_over_time(agent: Agent, horizon: int) -> list[np.ndarray]:
    spread = [np.array(agent.sigma0)]
    loop = agent.A - agent.B @ agent.gain
    for _ in range(horizon):
        spread.append(loop @ spread[-1] @ loop.T + agent.noise)
    return [matrix[: agent.dim, : agent.dim] for matrix in spread]


def faces_of_sum(one: np.ndarray, other: np.ndarray) -> list[Face]:
    """Faces of the Minkowski sum of two convex bodies in the plane or in space."""
    return _faces_of_sum(tuple(map(tuple, one.tolist())), tuple(map(tuple, other.tolist())))


@cache
def _faces_of_sum(*corners: tuple[tuple[float, ...], ...]) -> list[Face]:
    """Faces of the sum of two bodies, kept because many encounters have the same two.

    A face is normal to d - 1 differences of corners, and the corners that are farthest along its
    normal, of both bodies, differ in d - 1 independent directions.
    """
    one, other = map(np.array, corners)
    d = one.shape[1]
    edges = [b - a for body in (one, other) for a in body for b in body if (a != b).any()]
    if d == 2:
        normals = [np.array([edge[1], -edge[0]]) for edge in edges]
    else:
        normals = [np.cross(a, b) for a in edges for b in edges]
    faces: dict[tuple[float, ...], Face] = {}
    for normal in normals:
        length = sqrt(normal @ normal)
        if length < 1e-9:
            continue
        unit, reach, along = normal / length, 0.0, [np.zeros(d)]
        for body in (one, other):
            far = max(unit @ c for c in body)
            reach += float(far)
            touching = [c for c in body if unit @ c >= far - 1e-9]
            along += [c - touching[0] for c in touching]
        if np.linalg.matrix_rank(np.array(along), tol=1e-9) == d - 1:
            faces[tuple(unit.round(9) + 0.0)] = (unit, reach)
    return list(faces.values())


def margin_of(game: Game, faces: list[Face], apart: np.ndarray, spread: np.ndarray) -> float:
    best = -inf
    for normal, offset in faces:
        clearance = normal @ apart - offset
        sigma = sqrt(max(normal @ spread @ normal, 0.0))
        unit = sigma * sqrt(2) if game.scale == "exact" else sigma
        if unit > 1e-12:
            best = max(best, clearance / unit)
        elif clearance >= -1e-6:
            best = game.margin_cap
    return min(game.margin_cap, best)
