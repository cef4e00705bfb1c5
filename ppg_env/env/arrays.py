"""A game and its rules as flat arrays, the form in which the simulation kernel reads them.

States of agents with fewer components than the largest are padded with zeros.  Sizes: N agents,
E encounters, n state components, m inputs, d position components.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ppg_env.env.rules import Rules
from ppg_env.game.dynamics import square_root
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from ppg_env.game.margins import collision_faces, encounter_pairs, encounter_units
from ppg_env.game.polytope import Polytope

FREE, BOX, POLYGON, FACES = range(4)
"""How inputs are projected: not at all, per component, on a convex polygon, on half-spaces."""

NEVER = 2**31 - 1
"""An arrival time that no episode reaches."""


class Tables(NamedTuple):
    """What the kernel needs to know.

    state_axes, input_axes, axes: n, m and d zeros, see :mod:`ppg_env.env.kernel`;
    start (N, n), goal (N, n) and goal_size (N,): arrival regions, ``tolerance`` wide;
    A (N, n, n), B (N, n, m), root (N, n, n) with root root' = noise, start_root likewise sigma0;
    separable (N,): whether every axis moves by itself, input limits included;
    control_set (S, N): which control set v holds at each step, the last row for all later ones;
    projection (V,) with low, high (V, m); edges (see :func:`_edges`) and faces of the control
    sets, concatenated, those of set v from ``first_edge[v]`` and ``first_input[v]`` on;
    pair (E, 2), -1 for an obstacle; normals, offsets of encounter e from ``first_face[e]`` on,
    depths = offsets less the tolerance within which bodies only touch;
    units (H'+1, faces) lengths of one unit of margin, the last row for all later times;
    lam (N,) weights of time and crash_cost kappa;
    schedule (N,), centre (d,) and scale of observations.
    """

    state_axes: tuple[int, ...]
    input_axes: tuple[int, ...]
    axes: tuple[int, ...]
    start: np.ndarray
    goal: np.ndarray
    goal_size: np.ndarray
    tolerance: float
    A: np.ndarray
    B: np.ndarray
    root: np.ndarray
    start_root: np.ndarray
    random_start: bool
    separable: np.ndarray
    control_set: np.ndarray
    projection: np.ndarray
    low: np.ndarray
    high: np.ndarray
    edges: np.ndarray
    first_edge: np.ndarray
    input_normals: np.ndarray
    input_offsets: np.ndarray
    first_input: np.ndarray
    pair: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    depths: np.ndarray
    first_face: np.ndarray
    units: np.ndarray
    margin_cap: float
    lam: np.ndarray
    crash_cost: float
    schedule: np.ndarray
    scheduled: bool
    stay: bool
    remove_crashed: bool
    margin_reward: bool
    social: bool
    max_cycles: int
    centre: np.ndarray
    scale: float


def make_tables(game: Game, rules: Rules) -> Tables:
    """Flatten ``game`` under ``rules``."""
    agents, d, faces = game.agents, game.dim, collision_faces(game)
    N, n = len(agents), max(agent.state_dim for agent in agents)
    m = max(agent.control_dim for agent in agents)
    start, goal = np.zeros((N, n)), np.zeros((N, n))
    A, B, root, start_root = (np.zeros((N, n, k)) for k in (n, m, n, n))
    for i, agent in enumerate(agents):
        k, inputs = agent.state_dim, agent.control_dim
        start[i, :k], goal[i, : agent.goal.size] = agent.start, agent.goal
        A[i, :k, :k], B[i, :k, :inputs] = agent.A, agent.B
        root[i, :k, :k], start_root[i, :k, :k] = square_root(agent.noise), square_root(agent.sigma0)
    sets = [held for agent in agents for _, held in pieces(agent.control)]
    low, high = np.zeros((len(sets), m)), np.zeros((len(sets), m))
    for v, held in enumerate(sets):
        low[v, : held.dim], high[v, : held.dim] = held.bounds
    edges, inputs_faces = [_edges(held) for held in sets], [held.faces for held in sets]
    wide = [np.hstack([a, np.zeros((len(a), m - a.shape[1]))]) for a, _ in inputs_faces]
    places = np.array([[*agent.start[:d], *agent.goal[:d]] for agent in agents]).reshape(-1, d)
    spread = np.ptp(places, axis=0)
    return Tables(
        state_axes=(0,) * n,
        input_axes=(0,) * m,
        axes=(0,) * d,
        start=start,
        goal=goal,
        goal_size=np.array([agent.goal.size for agent in agents]),
        tolerance=float(rules.tolerance),
        A=A,
        B=B,
        root=root,
        start_root=start_root,
        random_start=bool(start_root.any()),
        separable=np.array([_separable(game, rules, i, n, m) for i in range(N)]),
        control_set=_control_set(game),
        projection=np.array([_projection(held, rules) for held in sets]),
        low=low,
        high=high,
        edges=np.concatenate(edges),
        first_edge=_firsts([len(rows) for rows in edges]),
        input_normals=np.concatenate(wide),
        input_offsets=np.concatenate([b for _, b in inputs_faces]),
        first_input=_firsts([len(a) for a in wide]),
        pair=encounter_pairs(game),
        normals=faces.normals,
        offsets=faces.offsets,
        depths=faces.depths,
        first_face=faces.first,
        units=np.hstack(
            [np.zeros((game.horizon + 1, 0)), *(encounter_units(game, e) for e in game.encounters)]
        ),
        margin_cap=game.margin_cap,
        lam=np.array([agent.lam for agent in agents]),
        crash_cost=game.crash_cost,
        schedule=np.array(rules.schedule or [NEVER] * N, dtype=np.int64),
        scheduled=rules.arrival == "schedule",
        stay=rules.on_goal == "stay",
        remove_crashed=rules.on_crash == "remove",
        margin_reward=rules.reward == "margin",
        social=rules.sharing == "social",
        max_cycles=rules.steps(game),
        centre=(places.max(axis=0) + places.min(axis=0)) / 2,
        scale=max(float(spread.max()) / 2, 1.0),
    )


def _control_set(game: Game) -> np.ndarray:
    """(S, N) number of the set that holds at each step, up to the last change of any."""
    firsts = [[first for first, _ in pieces(agent.control)] for agent in game.agents]
    steps = np.arange(max(mine[-1] for mine in firsts) + 1)
    held = [np.searchsorted(mine, steps, side="right") - 1 for mine in firsts]
    return np.column_stack(held) + _firsts([len(mine) for mine in firsts])[:-1]


def _projection(control: Polytope, rules: Rules) -> int:
    if rules.saturation == "none":
        return FREE
    if control.kind == "box" or control.dim == 1:
        return BOX
    return POLYGON if control.dim == 2 else FACES


def _separable(game: Game, rules: Rules, agent: int, states: int, inputs: int) -> bool:
    """One input per state component, all matrices diagonal, inputs limited one by one."""
    mover = game.agents[agent]
    matrices = (mover.A, mover.B, square_root(mover.noise))
    square = states == mover.state_dim == mover.control_dim == inputs
    straight = square and all(np.array_equal(M, np.diag(np.diag(M))) for M in matrices)
    return straight and all(
        _projection(held, rules) in (FREE, BOX) for _, held in pieces(mover.control)
    )


def _edges(control: Polytope) -> np.ndarray:
    """(K, 5) edges of a polygon, counter-clockwise: corner, unit tangent, length; else none."""
    if control.dim != 2:
        return np.zeros((0, 5))
    corners = control.vertices
    along = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(along, axis=1, keepdims=True)
    return np.hstack([corners, along / np.maximum(length, 1e-300), length])


def _firsts(sizes: list[int]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
