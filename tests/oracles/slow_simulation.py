"""Plain NumPy simulation of a profile on schedule, written apart from the package's kernels.

States follow their loops one agent at a time; bodies overlap if no edge of either separates them.
"""

from __future__ import annotations

import numpy as np

from ppg_env import Game
from ppg_env.game.plan import Profile


def slow_crashes(game: Game, profile: Profile, episodes: int, seed: int) -> np.ndarray:
    """Return (E, episodes) whether each encounter overlaps in traffic, as ``game`` counts it."""
    random = np.random.default_rng(seed)
    moves = [_positions(game, profile, i, episodes, random) for i in range(len(game.agents))]
    walls = [_drift(game, k, episodes, random) for k in range(len(game.obstacles))]
    bodies = [agent.shape.vertices for agent in game.agents]
    arrival = [np.inf if plan.arrival is None else plan.arrival for plan in profile]
    rows = []
    for i in range(len(bodies)):
        for j in range(i + 1, len(bodies)):
            ends = [arrival[i], arrival[j]]
            end = max(ends) if game.on_goal == "stay" else min(ends)
            rows.append(_met(game, bodies[i], bodies[j], moves[i] - moves[j], end))
    for i in range(len(bodies)):
        for k, obstacle in enumerate(game.obstacles):
            end = arrival[i]
            if game.on_goal == "stay" and obstacle.path is not None:
                end = max(end, len(obstacle.path) - 1)
            if obstacle.until is not None:
                end = min(end, obstacle.until)
            rows.append(_met(game, bodies[i], obstacle.shape.vertices, moves[i] - walls[k], end))
    return np.array(rows).reshape(-1, episodes)


def _positions(
    game: Game, profile: Profile, i: int, episodes: int, random: np.random.Generator
) -> np.ndarray:
    """Return (H+1, episodes, d); a body that stays rests where it was at its arrival."""
    agent, plan = game.agents[i], profile[i]
    n = agent.state_dim
    state = agent.start + random.multivariate_normal(np.zeros(n), agent.sigma0, episodes)
    path, parked = [state], False
    for t in range(game.horizon):
        parked = parked or (game.on_goal == "stay" and plan.arrival == t)
        if not parked:
            control = plan.controls[t] - (state - plan.means[t]) @ agent.gain.T
            noise = random.multivariate_normal(np.zeros(n), agent.noise, episodes)
            state = state @ agent.A.T + control @ agent.B.T + noise
        path.append(state)
    return np.array(path)[..., : game.dim]


def _drift(game: Game, k: int, episodes: int, random: np.random.Generator) -> np.ndarray:
    """Return (H+1, episodes, d) reference positions of an obstacle."""
    obstacle, error = game.obstacles[k], np.zeros((episodes, game.dim))
    places = []
    for t in range(game.horizon + 1):
        if obstacle.path is None:
            places.append(error)
            continue
        last = len(obstacle.path) - 1
        if 1 <= t <= last:
            error = error + random.multivariate_normal(np.zeros(game.dim), obstacle.noise, episodes)
        places.append(obstacle.path[min(t, last)] + error)
    return np.array(places)


def _met(
    game: Game, first: np.ndarray, second: np.ndarray, apart: np.ndarray, end: float
) -> np.ndarray:
    """Return (episodes,) whether polygons that are ``apart`` (H+1, episodes, 2) meet in traffic."""
    turned = [np.roll(corners, -1, axis=0) - corners for corners in map(_in_order, (first, second))]
    normals = np.vstack([side @ np.array([[0.0, -1.0], [1.0, 0.0]]) for side in turned])
    normals = np.vstack([normals, -normals])
    offsets = (second @ normals.T).max(axis=0) - (first @ normals.T).min(axis=0)
    gaps = apart @ normals.T - offsets  # (H+1, episodes, F), positive: separated
    if game.collisions == "instants":
        inside = (gaps < 0).all(axis=-1)
        return inside[: int(min(end, len(inside)))].any(axis=0)
    met = np.zeros(apart.shape[1], dtype=bool)
    for t in range(int(min(end, game.horizon))):
        before, after = gaps[t], gaps[t + 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            cross = before / (before - after)
        enter = np.where((before > 0) & (after <= 0), cross, 0.0).max(axis=-1)
        leave = np.where((before <= 0) & (after > 0), cross, 1.0).min(axis=-1)
        met |= ~((before > 0) & (after > 0)).any(axis=-1) & (enter <= leave)
    return met


def _in_order(corners: np.ndarray) -> np.ndarray:
    around = corners - corners.mean(axis=0)
    return corners[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
