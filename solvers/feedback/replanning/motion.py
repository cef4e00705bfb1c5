"""Arrays for rollouts: dynamics, control laws, moves, workspaces and the tracked plans.

Plans start now, from states that are known.  The errors that count for the time of arrival grow for
a few steps, because at full speed there is no input left to correct with.  The game's ``reserve``
counts for the tracked plans only: every other plan is made again at the next step.

Sizes: N agents, V control sets, n state components, m inputs, L steps of a plan, M moves, K laws.
"""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ppg_env.env.arrays import Tables
from ppg_env.game.agent import Agent
from ppg_env.game.effort_laws import goal_responses, least_effort_laws
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from ppg_env.game.plan import Profile
from ppg_env.game.polytope import Polytope
from ppg_env.game.workspace import workspace_limits, workspace_rows
from solvers.feedback.replanning.errors_ahead import errors_ahead
from solvers.feedback.replanning.normal_tail import normal_table

ANGLES = 16
"""Directions of moves in the plane."""

WINDOWS = ((0, 1), (0, 2), (0, 3), (0, 5), (1, 3), (2, 4))
"""Steps, from the first up to the second, in which a candidate moves differently."""

GROWTH = 3
"""Steps over which the deviation at arrival grows: later errors are corrected on the way."""


class Motion(NamedTuple):
    """How agents move and arrive, and what their plans may do.

    A (N, n, n), B (N, n, m), effort (N,), goal (N, n), goal_size (N,), tolerance: as in
    :class:`ppg_env.env.arrays.Tables`, and control_set (S, N), normals, offsets and first_face of
    the control sets;
    moves (V, M, m): inputs of each control set in many directions; windows (W, 2);
    laws (V,) number of laws of a set, law_gain (V, K, m, n), law_offset (V, K, m) and law_target
    (V, K, m, n): the first input of least effort to the goal is gain x + offset + target delta,
    for a target displaced by delta;
    deviations (N, L + 1, n) of the states at arrival;
    walls (rows, n), limits (L + 1, rows): faces of the workspaces, those of agent i from
    ``first_wall[i]`` on, and how far a mean may reach at each time of the game;
    feedback (N, m, n), nominal (N, L, m), means (N, L + 1, n), end (N,): the tracked plans;
    outside_cost: of each step that leads further out of the workspace;
    tail: see :func:`solvers.feedback.replanning.normal_tail.normal_table`.
    """

    A: np.ndarray
    B: np.ndarray
    effort: np.ndarray
    goal: np.ndarray
    goal_size: np.ndarray
    tolerance: np.ndarray
    control_set: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    first_face: np.ndarray
    moves: np.ndarray
    windows: np.ndarray
    laws: np.ndarray
    law_gain: np.ndarray
    law_offset: np.ndarray
    law_target: np.ndarray
    deviations: np.ndarray
    walls: np.ndarray
    limits: np.ndarray
    first_wall: np.ndarray
    outside_cost: float
    feedback: np.ndarray
    nominal: np.ndarray
    means: np.ndarray
    end: np.ndarray
    tail: np.ndarray


def make_motion(game: Game, tables: Tables, profile: Profile) -> Motion:
    """Return the arrays about the agents; ``profile`` are the plans to fall back on."""
    n, m = tables.start.shape[1], tables.limits.shape[2]
    sets = [admissible for agent in game.agents for _, admissible in pieces(agent.control)]
    return Motion(
        A=tables.A,
        B=tables.B,
        effort=tables.effort,
        goal=tables.goal,
        goal_size=tables.agent_codes[0],
        tolerance=tables.tolerance,
        control_set=tables.control_set,
        normals=tables.input_normals,
        offsets=tables.input_offsets,
        first_face=tables.first_row[1],
        moves=_moves(sets, m),
        windows=np.array(WINDOWS, dtype=np.int64),
        **_laws(game, n, m),
        deviations=_arrival_deviations(game, n),
        **_workspaces(game),
        outside_cost=game.crash_cost,
        **_tracked(game, profile, n, m),
        tail=normal_table(),
    )


def _moves(sets: list[Polytope], m: int) -> np.ndarray:
    """Return inputs on the boundary of each set, half-way to it, and its centre."""
    result = []
    for admissible in sets:
        directions, centre = _directions(admissible.dim), _centre(admissible)
        along = directions @ admissible.normals.T
        room = admissible.offsets - admissible.normals @ centre
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = np.where(along > 1e-12, np.maximum(room, 0.0) / along, np.inf).min(axis=1)
        steps = np.vstack([directions * reach[:, None], 0.5 * directions[::2] * reach[::2, None]])
        inputs = np.vstack([centre + steps, centre])
        result.append(np.pad(inputs, ((0, 0), (0, m - inputs.shape[1]))))
    most = max(len(inputs) for inputs in result)
    return np.stack([np.pad(r, ((0, most - len(r)), (0, 0)), mode="edge") for r in result])


def _centre(admissible: Polytope) -> np.ndarray:
    zero = np.zeros(admissible.dim)
    return zero if admissible.clearance(zero) <= 0 else admissible.vertices.mean(axis=0)


def _directions(m: int) -> np.ndarray:
    if m == 2:
        angles = 2 * np.pi * np.arange(ANGLES) / ANGLES
        return np.column_stack([np.cos(angles), np.sin(angles)])
    if m > 3:
        return np.vstack([np.eye(m), -np.eye(m)])
    signs = np.array([s for s in product((-1.0, 0.0, 1.0), repeat=m) if any(s)])
    return signs / np.linalg.norm(signs, axis=1, keepdims=True)


def _laws(game: Game, n: int, m: int) -> dict[str, Any]:
    """Return the fields about control laws."""
    laws = []
    for agent in game.agents:
        for _, admissible in pieces(agent.control):
            laws.append(_targeted(agent, game.horizon, admissible))
    V, K = len(laws), max(len(gains) for gains, _, _ in laws)
    gain, offset, target = np.zeros((V, K, m, n)), np.zeros((V, K, m)), np.zeros((V, K, m, n))
    for v, (gains, offsets, targets) in enumerate(laws):
        k, rows, columns = gains.shape
        gain[v, :k, :rows, :columns], offset[v, :k, :rows] = gains, offsets
        target[v, :k, :rows, : targets.shape[2]] = targets
    counts = np.array([len(gains) for gains, _, _ in laws], dtype=np.int64)
    return {"laws": counts, "law_gain": gain, "law_offset": offset, "law_target": target}


def _targeted(
    agent: Agent, horizon: int, admissible: Polytope
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return gains (K, m, n), offsets (K, m), and how these change with the goal (K, m, g)."""
    laws = least_effort_laws(agent, horizon, admissible)
    responses = goal_responses(agent, horizon, admissible)
    offsets = np.array([law[1] for law in laws])
    return np.array([law[0] for law in laws]), offsets, np.array(responses)


def _arrival_deviations(game: Game, n: int) -> np.ndarray:
    """Return (N, L + 1, n) deviations of states without correction."""
    result = np.zeros((len(game.agents), game.horizon + 1, n))
    for i, agent in enumerate(game.agents):
        errors = errors_ahead(agent, np.minimum(np.arange(game.horizon + 1), GROWTH))
        diagonal = np.diagonal(errors, axis1=1, axis2=2)
        result[i, :, : agent.state_dim] = np.sqrt(diagonal.clip(0.0))
    return result


def _workspaces(game: Game) -> dict[str, Any]:
    """Return the fields about workspaces."""
    n = max(agent.state_dim for agent in game.agents)
    rows = [workspace_rows(agent) for agent in game.agents]
    limits = [workspace_limits(agent, game.horizon) for agent in game.agents]
    return {
        "walls": np.concatenate([np.pad(r, ((0, 0), (0, n - r.shape[1]))) for r in rows]),
        "limits": np.concatenate(limits, axis=1),
        "first_wall": np.cumsum([0, *map(len, rows)], dtype=np.int64),
    }


def _tracked(game: Game, profile: Profile, n: int, m: int) -> dict[str, Any]:
    """Return the fields about the tracked plans."""
    N, L = len(game.agents), game.horizon
    feedback, nominal, means = np.zeros((N, m, n)), np.zeros((N, L, m)), np.zeros((N, L + 1, n))
    end = np.zeros(N, dtype=np.int64)
    for i, (agent, plan) in enumerate(zip(game.agents, profile, strict=True)):
        rows, columns = agent.gain.shape
        feedback[i, :rows, :columns] = agent.gain
        nominal[i, :, :rows], means[i, :, :columns] = plan.controls, plan.means
        end[i] = L if plan.arrival is None else plan.arrival
    return {"feedback": feedback, "nominal": nominal, "means": means, "end": end}
