"""Random small games in the plane, and random plans for them."""

from __future__ import annotations

import numpy as np

from ppg_env import Agent, Game, Plan, Polytope, make_plan

HORIZON = 7


def random_game(seed: int) -> tuple[Game, np.random.Generator]:
    """Two or three polygons of random shape, noise and speed, meeting near the origin."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 4))
    agents = []
    for k in range(count):
        angle = 2 * np.pi * (k + 0.6 * random.random()) / count
        start = 25 * np.array([np.cos(angle), np.sin(angle)])
        root = random.normal(size=(2, 2))
        agents.append(
            Agent(
                start=start,
                goal=-start + random.normal(size=2) * 4,
                shape=_polygon(random, 4.0),
                control=_polygon(random, 26.0),
                lam=float(random.uniform(0.1, 0.9)),
                gain=float(random.uniform(0, 0.9)),
                noise=root @ root.T + 0.2 * np.eye(2),
            )
        )
    objective = "risk" if random.random() < 0.5 else "margin"
    return Game(tuple(agents), horizon=HORIZON, objective=objective), random


def _polygon(random: np.random.Generator, radius: float) -> Polytope:
    """Four to six corners, near those of a regular polygon, around the origin."""
    corners = int(random.integers(4, 7))
    angles = 2 * np.pi * (np.arange(corners) + random.uniform(-0.2, 0.2, corners)) / corners
    sizes = radius * random.uniform(0.8, 1.2, corners)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    return Polytope.from_vertices(sizes[:, None] * circle)


def drawn_plan(agent: Agent, random: np.random.Generator) -> Plan | None:
    """A plan to the goal in a random time: the straight one bent as far as its controls allow."""
    steps = int(random.integers(1, HORIZON + 1))
    even = np.tile((agent.goal - agent.start) / steps, (steps, 1))
    bend = random.normal(size=(steps, 2))
    bend -= bend.mean(axis=0)
    control = agent.control_at(0)
    room = control.offsets - even @ control.normals.T
    push = bend @ control.normals.T
    if (room < 0).any():
        return None
    far = np.min(room[push > 1e-12] / push[push > 1e-12], initial=100.0)
    controls = np.zeros((HORIZON, 2))
    controls[:steps] = even + random.uniform(0, 1) * (far - 1e-9) * bend
    return make_plan(agent, controls)
