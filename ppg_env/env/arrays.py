"""A game and its rules as flat arrays, the form in which the simulation kernel reads them.

States of agents with fewer components than the largest are padded with zeros.  Sizes: N agents,
E encounters, V control sets, n state components, m inputs, d position components.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ppg_env.env.arrival_regions import checked_tolerances
from ppg_env.env.encounter_tables import encounter_tables
from ppg_env.env.observation import moving_obstacles, observation_frame
from ppg_env.env.rules import Rules
from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import square_root
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from ppg_env.game.polytope import Polytope

FREE, BOX, POLYGON, FACES = range(4)
"""Projections of inputs: none, per component, on a convex polygon, on half-spaces."""

NEVER = 2**31 - 1
"""An arrival time beyond every episode."""


class Tables(NamedTuple):
    """The arguments of the kernel that no step changes.

    state_axes, input_axes, axes: n, m and d zeros, see :mod:`ppg_env.env.kernel`;
    playing (N,) whether the agent takes part, start (N, n), goal (N, n); of each copy in turn,
    (C N, ...), if they differ (:mod:`ppg_env.env.variation`), and so the roots of the noise;
    tolerance (N, n): half widths of arrival regions around goals;
    agent_codes (4, N): sizes of goals, times of arrival on schedule, whether the agent is
    separable (no axis affects another, input limits included), and numbers of inputs;
    A (N, n, n), B (N, n, m), root (N + K, n, n) with root root' = noise, of agents and of moving
    obstacles, start_root (N, n, n) likewise sigma0;
    control_set (S, N): the control set v of each agent at each step, the last row for all later
    steps; projection (V,) with low, high = limits (2, V, m); edges (see :func:`_edges`) and faces
    of the control sets, concatenated, those of set v from ``first_row[0, v]`` and
    ``first_row[1, v]`` on;
    effort (N,) weights of the inputs' sizes;
    path (K, L, n), the positions of moving obstacles, padded with their last; obstacle_times
    (K, 2), the times of rest and removal; whether any is ``drifting``; last_motion, the time from
    which none of them moves;
    pair (E, 4) bodies i and j, j = -1 for an obstacle at rest, N + k for the moving obstacle k;
    then the first face of the encounter and the one after its last, among the normals, offsets and
    depths of the collision sets (:class:`ppg_env.game.margins.CollisionFaces`); own_faces, the
    number of faces of each copy if the bodies differ between copies, else 0;
    units (3, H'+1, faces) lengths of one unit of margin, and the squares of those due to either
    body alone, the last row for all later times; no faces unless ``margin_reward``;
    extents (2, N + O, d) of all bodies (:mod:`ppg_env.env.encounter_tables`); sorting, whether
    there are so many that sorting finds the pairs that can meet;
    crash_cost kappa;
    centre (d,) and scale of observations (:mod:`ppg_env.env.observation`).
    """

    state_axes: tuple[int, ...]
    input_axes: tuple[int, ...]
    axes: tuple[int, ...]
    playing: np.ndarray
    start: np.ndarray
    goal: np.ndarray
    agent_codes: np.ndarray
    tolerance: np.ndarray
    A: np.ndarray
    B: np.ndarray
    root: np.ndarray
    start_root: np.ndarray
    random_start: bool
    control_set: np.ndarray
    projection: np.ndarray
    limits: np.ndarray
    edges: np.ndarray
    input_normals: np.ndarray
    input_offsets: np.ndarray
    first_row: np.ndarray
    effort: np.ndarray
    path: np.ndarray
    obstacle_times: np.ndarray
    drifting: bool
    last_motion: int
    pair: np.ndarray
    own_faces: int
    normals: np.ndarray
    offsets: np.ndarray
    depths: np.ndarray
    units: np.ndarray
    extents: np.ndarray
    sorting: bool
    margin_cap: float
    crash_cost: float
    scheduled: bool
    stay: bool
    swept: bool
    remove_crashed: bool
    margin_reward: bool
    social: bool
    max_cycles: int
    centre: np.ndarray
    scale: float


def make_tables(game: Game, rules: Rules) -> Tables:
    """Return ``game`` under ``rules`` as arrays."""
    n = max(agent.state_dim for agent in game.agents)
    m = max(agent.control_dim for agent in game.agents)
    centre, scale = observation_frame(game)
    return Tables(
        state_axes=(0,) * n,
        input_axes=(0,) * m,
        axes=(0,) * game.dim,
        **_dynamics(game, n, m),
        tolerance=_tolerance(game, rules, n),
        agent_codes=np.array(
            [
                [agent.goal.size for agent in game.agents],
                rules.schedule or [NEVER] * len(game.agents),
                [_separable(agent, rules, n, m) for agent in game.agents],
                [agent.control_dim for agent in game.agents],
            ],
            dtype=np.int64,
        ),
        **_control_sets(game, rules, m),
        **_obstacles(game, n),
        **encounter_tables(game, rules.reward == "margin"),
        **_rules(game, rules),
        centre=centre,
        scale=scale,
    )


def _dynamics(game: Game, n: int, m: int) -> dict[str, Any]:
    """Return the fields about starts, goals, motion and preferences of the agents."""
    agents, N = game.agents, len(game.agents)
    start, goal = np.zeros((N, n)), np.zeros((N, n))
    moving = moving_obstacles(game)
    A, B, start_root = (np.zeros((N, n, k)) for k in (n, m, n))
    root = np.zeros((N + len(moving), n, n))
    for b, k in enumerate(moving):
        root[N + b, : game.dim, : game.dim] = square_root(game.obstacles[k].noise)
    for i, agent in enumerate(agents):
        k, inputs = agent.state_dim, agent.control_dim
        start[i, :k], goal[i, : agent.goal.size] = agent.start, agent.goal
        A[i, :k, :k], B[i, :k, :inputs] = agent.A, agent.B
        root[i, :k, :k], start_root[i, :k, :k] = square_root(agent.noise), square_root(agent.sigma0)
    return {
        "playing": np.ones(N, dtype=np.bool_),
        "start": start,
        "goal": goal,
        "A": A,
        "B": B,
        "root": root,
        "start_root": start_root,
        "random_start": bool(start_root.any()),
        "effort": np.array([agent.effort for agent in agents]),
    }


def _tolerance(game: Game, rules: Rules, n: int) -> np.ndarray:
    """Return (N, n) half widths of the arrival regions, zero for components without a goal."""
    result = np.zeros((len(game.agents), n))
    for row, half in zip(result, checked_tolerances(game, rules), strict=True):
        row[: half.size] = half
    return result


def _control_sets(game: Game, rules: Rules, m: int) -> dict[str, Any]:
    """Return the fields about control sets, those of each agent in the order of their steps."""
    sets = [control for agent in game.agents for _, control in pieces(agent.control)]
    limits = np.zeros((2, len(sets), m))
    for v, control in enumerate(sets):
        limits[:, v, : control.dim] = control.bounds
    edges, faces = [_edges(control) for control in sets], [control.faces for control in sets]
    padded = [np.hstack([a, np.zeros((len(a), m - a.shape[1]))]) for a, _ in faces]
    return {
        "control_set": _control_set(game),
        "projection": np.array([_projection(control, rules) for control in sets]),
        "limits": limits,
        "edges": np.concatenate(edges),
        "input_normals": np.concatenate(padded),
        "input_offsets": np.concatenate([b for _, b in faces]),
        "first_row": np.stack([_firsts([len(rows) for rows in kind]) for kind in (edges, padded)]),
    }


def _obstacles(game: Game, n: int) -> dict[str, Any]:
    """Return the fields about moving obstacles."""
    obstacles = [game.obstacles[k] for k in moving_obstacles(game)]
    K, longest = len(obstacles), max((obstacle.rest for obstacle in obstacles), default=0)
    path, times = np.zeros((K, longest + 1, n)), np.zeros((K, 2), dtype=np.int64)
    for k, obstacle in enumerate(obstacles):
        path[k, :, : game.dim] = obstacle.positions(longest)
        times[k] = obstacle.rest, NEVER if obstacle.until is None else obstacle.until
    return {
        "path": path,
        "obstacle_times": times,
        "drifting": any(obstacle.noise.any() for obstacle in obstacles),
        "last_motion": int(times.min(axis=1).max(initial=0)),
    }


def _rules(game: Game, rules: Rules) -> dict[str, Any]:
    """Return the fields about the rules of play."""
    return {
        "scheduled": rules.arrival == "schedule",
        "stay": rules.on_goal == "stay",
        "swept": game.collisions == "swept",
        "remove_crashed": rules.on_crash == "remove",
        "margin_reward": rules.reward == "margin",
        "social": rules.sharing == "social",
        "max_cycles": rules.steps(game),
    }


def _control_set(game: Game) -> np.ndarray:
    """Return (S, N) the number of the set in force at each step, up to the last change of any."""
    firsts = [[first for first, _ in pieces(agent.control)] for agent in game.agents]
    steps = np.arange(max(starts[-1] for starts in firsts) + 1)
    current = [np.searchsorted(starts, steps, side="right") - 1 for starts in firsts]
    return np.column_stack(current) + _firsts([len(starts) for starts in firsts])[:-1]


def _projection(control: Polytope, rules: Rules) -> int:
    if rules.saturation == "none":
        return FREE
    if control.kind == "box" or control.dim == 1:
        return BOX
    return POLYGON if control.dim == 2 and not control.is_flat else FACES


def _separable(agent: Agent, rules: Rules, n: int, m: int) -> bool:
    """Return whether each input moves one state component and nothing couples components."""
    matrices = (agent.A, agent.B, square_root(agent.noise))
    square = n == agent.state_dim == agent.control_dim == m
    diagonal = square and all(np.array_equal(M, np.diag(np.diag(M))) for M in matrices)
    return diagonal and all(
        _projection(control, rules) in (FREE, BOX) for _, control in pieces(agent.control)
    )


def _edges(control: Polytope) -> np.ndarray:
    """Return (K, 5) edges of a polygon, counter-clockwise: corner, unit tangent, length.

    K = 0 in other dimensions.
    """
    if control.dim != 2:
        return np.zeros((0, 5))
    corners = control.vertices
    along = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(along, axis=1, keepdims=True)
    return np.hstack([corners, along / np.maximum(length, 1e-300), length])


def _firsts(sizes: list[int]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
