"""Random small games that mix everything a game may have, for comparisons of solvers.

Single and double integrators, sheared and damped dynamics, whole goals and places, matrices of
gains and noises, boxes, balls and polygons, control sets that change over time (now and then to
one that only lets drift, or forbids rest), obstacles, a first covariance, one to three dimensions.
On demand also games in motion: swept collisions, parked bodies, workspaces and speed limits,
reserves, efforts, and obstacles that move.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env import Agent, Game, InputError, Polytope, make_profile
from ppg_env.game.dynamics import covariances
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.input_sets import Controls, set_at
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.plan import Profile, make_plan
from ppg_env.game.reserve import planned_controls

HORIZON = 6


@dataclass(frozen=True)
class Mixed:
    """A game, and plans of all agents that arrive, whether or not bodies overlap on the way."""

    game: Game
    profile: Profile


def mixed_game(seed: int, count: int = 2, *, in_motion: bool = False) -> Mixed:
    """The game of a seed: agents that cross near the origin, in one to three dimensions.

    ``in_motion`` gives it fields that the paper's games do not have.
    """
    random = np.random.default_rng(seed)
    dim = int(random.choice([1, 2, 2, 2, 3]))
    while True:
        try:
            movers = [_mover(random, dim, k, in_motion) for k in range(count)]
            walls = tuple(_wall(random, dim) for _ in range(int(random.integers(0, 2))))
            walls = walls if dim > 1 else ()
            rules = {}
            if in_motion:
                walls += (_crossing(random, dim),) * int(random.random() < 0.5)
                rules["collisions"] = str(random.choice(["instants", "swept"], p=[0.25, 0.75]))
                rules["on_goal"] = str(random.choice(["remove", "stay"]))
            game = Game(
                tuple(agent for agent, _ in movers),
                walls,
                horizon=HORIZON,
                objective=str(random.choice(["margin", "risk"])),
                margin_cap=float(random.uniform(1.0, 5.0)),
                crash_cost=float(random.choice([1.0, 30.0, 200.0])),
                **rules,
            )
        except InputError:  # bodies overlap at the start or parked, or a reserve takes all
            continue
        return Mixed(game, make_profile(game, [controls for _, controls in movers]))


def _mover(
    random: np.random.Generator, dim: int, k: int, in_motion: bool
) -> tuple[Agent, np.ndarray]:
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
    if in_motion:
        fields["reserve"] = float(random.choice([0.0, 0.5, 1.5]))
        fields["effort"] = float(random.choice([0.0, 0.03, 0.4]))
    draft = Agent(start=start, goal=np.zeros(n), **fields)
    controls, sets = np.zeros((HORIZON, dim)), planned_controls(draft, HORIZON)
    for t in range(steps):
        corners = set_at(sets, t).vertices
        weight = random.dirichlet(np.exp(0.3 * corners @ towards).clip(0.05, 20))
        controls[t] = weight @ corners
    means = make_plan(draft, controls).means
    goal, size = means[steps], n if random.random() < 0.5 else dim
    if in_motion:
        fields["within"] = _regions(random, draft, means[: steps + 1])
    return Agent(start=start, goal=goal[:size], **fields), controls


def _regions(
    random: np.random.Generator, agent: Agent, means: np.ndarray
) -> tuple[HalfSpaces, ...]:
    """None, a box of positions and a speed limit, or both, that ``means`` (T+1, n) keep."""
    spread = covariances(agent, HORIZON)[: len(means)]
    sigmas = float(random.choice([0.0, 1.0]))
    room = sigmas * np.sqrt(spread.diagonal(axis1=1, axis2=2)) + random.uniform(0.1, 1.5)
    low, high = (means - room).min(axis=0), (means + room).max(axis=0)
    regions = []
    if random.random() < 0.4:
        d = agent.dim
        regions.append(HalfSpaces.between(low[:d], high[:d], sigmas))
    if agent.state_dim > agent.dim and random.random() < 0.7:
        free = np.where(np.arange(agent.state_dim) < agent.dim, np.inf, 0.0)
        regions.append(HalfSpaces.between(low - free, high + free, sigmas))
    return tuple(regions)


def _crossing(random: np.random.Generator, dim: int) -> Obstacle:
    """A small body that passes near the origin, stops there or vanishes."""
    first, last = random.uniform(-6, 6, (2, dim))
    count = int(random.integers(2, HORIZON + 1))
    return Obstacle(
        _body(random, dim, 0.8),
        path=np.linspace(first, last, count),
        noise=float(random.choice([0.0, 0.1])),
        until=int(random.integers(2, HORIZON)) if random.random() < 0.4 else None,
    )


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
