r"""The plans of one agent that arrive at a given time, others ignored, as linear constraints.

xbar_k = A^k x_0 + sum_{l<k} A^(k-1-l) B u_l,   u_l in U_l,   xbar_k within,   xbar_t = goal
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import goal_selector
from ppg_env.game.input_sets import set_at
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import workspace_limits, workspace_rows

MOST_ROUNDS = 100
"""Rounds of adding violated rows in the program of least norm."""


class PlanConstraints(NamedTuple):
    """Controls u (t m,) in a row:  faces u <= offsets,  inside u <= room,  effect u = change.

    faces, offsets: of the control sets less the reserve; inside, room: of the workspace at times
    1..t; effect, change: of the goal's components at time t.
    """

    faces: np.ndarray
    offsets: np.ndarray
    inside: np.ndarray
    room: np.ndarray
    effect: np.ndarray
    change: np.ndarray


def plan_constraints(agent: Agent, arrival: int, horizon: int) -> PlanConstraints:
    """Return the constraints of plans that arrive at time ``arrival`` >= 1."""
    from scipy.linalg import block_diag

    n, m = agent.state_dim, agent.control_dim
    drift, effect = agent.start, np.zeros((n, arrival * m))
    rows, limits = workspace_rows(agent), workspace_limits(agent, horizon)
    inside, room = [np.zeros((0, arrival * m))], [np.zeros(0)]
    for k in range(arrival):
        drift, effect = agent.A @ drift, agent.A @ effect
        effect[:, k * m : (k + 1) * m] = agent.B
        if len(rows):
            inside.append(rows @ effect)
            room.append(limits[k + 1] - rows @ drift)
    control, select = planned_controls(agent, horizon), goal_selector(agent)
    faces = [set_at(control, k).faces for k in range(arrival)]
    return PlanConstraints(
        block_diag(*(normals for normals, _ in faces)),
        np.concatenate([offsets for _, offsets in faces]),
        np.concatenate(inside),
        np.concatenate(room),
        select @ effect,
        agent.goal - select @ drift,
    )


def some_controls(constraints: PlanConstraints) -> np.ndarray | None:
    """Return controls that satisfy the constraints, by a linear program; None if none do."""
    from scipy.optimize import linprog
    from scipy.sparse import csr_array, vstack

    faces, offsets, inside, room, effect, change = constraints
    solution = linprog(
        np.zeros(faces.shape[1]),
        A_ub=vstack([csr_array(faces), csr_array(inside)]),
        b_ub=np.concatenate([offsets, room]),
        A_eq=effect,
        b_eq=change,
        bounds=(None, None),
        method="highs",
    )
    return solution.x if solution.status == 0 else None


def least_norm_controls(constraints: PlanConstraints, slack: float) -> np.ndarray | None:
    r"""Return the controls of least norm that satisfy the constraints up to ``slack``.

    With the equations solved by u = u_0 + Z y, u_0 of least norm and Z' Z = I, it remains to find
    the shortest y with G y <= h.  Rows that the last y violates are added until none is.  The
    result is None if no such controls are found.
    """
    rows = np.concatenate([constraints.faces, constraints.inside])
    limits = np.concatenate([constraints.offsets, constraints.room])
    first, along = _solved(constraints)
    reduced, left = rows @ along, limits - rows @ first + slack
    lengths = np.linalg.norm(reduced, axis=1)
    crossing = lengths > 1e-10 * np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
    if (left[~crossing] < 0).any():
        return None
    reduced, left = reduced[crossing] / lengths[crossing, None], left[crossing] / lengths[crossing]
    chosen, y = np.zeros(len(left), dtype=bool), np.zeros(along.shape[1])
    for _ in range(MOST_ROUNDS):
        violated = ~chosen & (reduced @ y - left > 0.1 * slack)
        if not violated.any():
            return first + along @ y
        chosen |= violated
        shortest = _shortest(reduced[chosen], left[chosen])
        if shortest is None:
            return None
        y = shortest
    return None


def _shortest(rows: np.ndarray, limits: np.ndarray) -> np.ndarray | None:
    r"""Return the shortest y with ``rows`` y <= ``limits``; None if there is none.

    A least-distance program, solved exactly by non-negative least squares (Lawson and Hanson 1974,
    chapter 23):

        minimise |E w - f|,  w >= 0,    E = [-rows'; -limits'],  f = (0, .., 0, 1),
        y = -r / r_last,     r = E w - f
    """
    from scipy.optimize import nnls

    scale = max(float(np.abs(limits).max()), 1e-300)
    columns = -np.vstack([rows.T, limits / scale])
    target = np.r_[np.zeros(rows.shape[1]), 1.0]
    try:
        weights, distance = nnls(columns, target)
    except RuntimeError:  # too many iterations
        return None
    if distance < 1e-9:
        return None
    rest = columns @ weights - target
    return -scale * rest[:-1] / rest[-1]


def _solved(constraints: PlanConstraints) -> tuple[np.ndarray, np.ndarray]:
    """Return u_0 and Z of the equations: those of the goal, and those of flat control sets."""
    faces, offsets, _, _, effect, change = constraints
    sizes = np.maximum(np.linalg.norm(effect, axis=1), 1e-300)
    level = _opposite(faces, offsets)
    equal = np.concatenate([effect / sizes[:, None], faces[level]])
    values = np.concatenate([change / sizes, offsets[level]])
    first = np.linalg.lstsq(equal, values, rcond=None)[0]
    _, spread, axes = np.linalg.svd(equal)
    rank = int((spread > 1e-12 * spread.max(initial=0.0)).sum())
    return first, axes[rank:].T


def _opposite(faces: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the numbers of faces whose opposite leaves no width: the first of each pair."""
    order = {(row + 0.0).tobytes(): k for k, row in enumerate(faces)}
    pairs = [(k, order.get((0.0 - row).tobytes())) for k, row in enumerate(faces)]
    reach = max(float(np.abs(offsets).max()), 1e-300)
    flat = [
        k for k, j in pairs
        if j is not None and k < j and offsets[k] + offsets[j] <= 1e-12 * reach
    ]  # fmt: skip
    return np.array(flat, dtype=int)
