"""Random small games that mix everything a game may have, for comparisons of solvers.

Single and double integrators, sheared and damped dynamics, whole goals and places, matrices of
gains and noises, boxes, balls and polygons, control sets that change over time (now and then to
one that only lets drift, or forbids rest), obstacles, a first covariance, one to three dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env import Agent, Game, InputError, Polytope, make_profile
from ppg_env.game.input_sets import Controls
from ppg_env.game.plan import Profile, make_plan

HORIZON = 6


@dataclass(frozen=True)
class Mixed:
    """A game, and plans of all agents that arrive, whether or not bodies overlap on the way."""

    game: Game
    profile: Profile


def mixed_game(seed: int, count: int = 2) -> Mixed:
    """The game of a seed: agents that cross near the origin, in one to three dimensions."""
    random = np.random.default_rng(seed)
    dim = int(random.choice([1, 2, 2, 2, 3]))
    while True:
        movers = [_mover(random, dim, k) for k in range(count)]
        walls = tuple(_wall(random, dim) for _ in range(int(random.integers(0, 2))))
        try:
            game = Game(
                tuple(agent for agent, _ in movers),
                walls if dim > 1 else (),
                horizon=HORIZON,
                objective=str(random.choice(["margin", "risk"])),
                margin_cap=float(random.uniform(1.0, 5.0)),
                crash_cost=float(random.choice([1.0, 30.0, 200.0])),
            )
        except InputError:  # bodies overlap at the start
            continue
        return Mixed(game, make_profile(game, [controls for _, controls in movers]))


def _mover(random: np.random.Generator, dim: int, k: int) -> tuple[Agent, np.ndarray]:
    """An agent whose goal is where random controls (H, m) lead it."""
    A, B = _dynamics(random, dim)
    n = len(A)
    root = random.normal(size=(n, n)) * 0.4
    fields = {
        "shape": _body(random, dim, random.uniform(1.0, 2.5)),
        "control": _controls(random, dim, n > dim),
        "lam": float(random.choice([0.0, 0.2, 0.5, 0.9])),
        "gain": random.uniform(0, 0.5, (dim, n)) * (random.random() < 0.7),
        "noise": (root @ root.T + 0.1 * np.eye(n)) * random.choice([0.1, 1.0]),
        "sigma0": 0.3 * (root @ root.T) if random.random() < 0.4 else 0.0,
        "A": A,
        "B": B,
    }
    start = np.zeros(n)
    towards = np.zeros(dim)
    towards[k % dim] = 1.0 if k < dim else -1.0
    start[:dim] = -towards * random.uniform(4, 8) + random.uniform(-1, 1, dim)
    if n > dim and random.random() < 0.5:
        start[dim:] = towards * random.uniform(0, 2)
    steps = int(random.integers(3, HORIZON + 1))
    draft = Agent(start=start, goal=np.zeros(n), **fields)
    controls = np.zeros((HORIZON, dim))
    for t in range(steps):
        corners = draft.control_at(t).vertices
        weight = random.dirichlet(np.exp(0.3 * corners @ towards).clip(0.05, 20))
        controls[t] = weight @ corners
    goal = make_plan(draft, controls).means[steps]
    size = n if random.random() < 0.5 else dim
    return Agent(start=start, goal=goal[:size], **fields), controls


def _dynamics(random: np.random.Generator, dim: int) -> tuple[np.ndarray, np.ndarray]:
    one, none = np.eye(dim), np.zeros((dim, dim))
    match int(random.integers(4)):
        case 0:
            return one, one
        case 1:
            return one + 0.1 * random.normal(size=(dim, dim)), one + 0.2 * np.tri(dim, k=-1)
        case 2:
            return np.block([[one, one], [none, one]]), np.vstack([0.5 * one, one])
        case _:
            return np.block([[one, one], [none, 0.7 * one]]), np.vstack([none, one])


def _controls(random: np.random.Generator, dim: int, accelerates: bool) -> Controls:
    """A set that may change once or twice, to any other."""
    size = 2.0 if accelerates else 5.0
    sets = [_control(random, dim, size) for _ in range(int(random.integers(1, 4)))]
    if len(sets) == 1:
        return sets[0]
    later = np.sort(random.choice(np.arange(1, HORIZON), len(sets) - 1, replace=False))
    return tuple(zip([0, *later.tolist()], sets, strict=True))


def _control(random: np.random.Generator, dim: int, size: float) -> Polytope:
    limit = size * random.uniform(0.4, 1.2)
    kind = random.random()
    if kind < 0.35:
        return Polytope.box(2 * limit * random.uniform(0.5, 1.0, dim))
    if kind < 0.45:
        return Polytope.box([0.0] * dim)  # only drift
    if kind < 0.65:
        return Polytope.l1(limit, dim)
    if kind < 0.85 or dim == 1:
        return _body(random, dim, limit)
    return Polytope.from_vertices(_body(random, dim, limit).vertices + 1.5 * limit)  # no rest


def _body(random: np.random.Generator, dim: int, radius: float) -> Polytope:
    if dim == 1 or random.random() < 0.3:
        return Polytope.box(2 * radius * random.uniform(0.6, 1.0, dim))
    if dim == 2:
        corners = int(random.integers(3, 6))
        angles = 2 * np.pi * (np.arange(corners) + random.uniform(-0.2, 0.2, corners)) / corners
        return Polytope.from_vertices(
            radius * np.column_stack([np.cos(angles), np.sin(angles)]).round(2)
        )
    return Polytope.l1(radius * 1.3, dim)


def _wall(random: np.random.Generator, dim: int) -> Polytope:
    return Polytope.from_vertices(_body(random, dim, 1.0).vertices + random.uniform(-3, 3, dim))
