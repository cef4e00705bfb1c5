"""Compiled: the move of agents and obstacles in a step, and the arrivals of agents.

Every function moves the copies from ``first`` up to ``last``; ``varied`` says that copies have
roots and goals of their own; other arguments are as in :mod:`ppg_env.env.kernel`.

Agents whose axes do not interact, the paper's case, move in loops over all components of all
copies at once.  These choose values instead of branches: the processor works on several at a time,
and what differs from copy to copy cannot be predicted.
"""

from __future__ import annotations

import numpy as np

from ppg_env.env.arrays import BOX, FACES, POLYGON
from ppg_env.env.projection import project_on_faces, project_on_polygon
from ppg_env.env.status import ARRIVED, TRAFFIC
from ppg_env.support.compilation import njit

ROWS = 7
"""Numbers that a component's move takes: factors of state, input and noise, bounds of the input,
goal and half width of the arrival region."""


@njit(cache=True)
def component_rows(
    varied, first, last, state_axes, clock, A, B, root, control_set, projection, limits, goal,
    goal_size, tolerance, rows,
):  # fmt: skip
    """Write the ``ROWS`` numbers of every component of every agent of the copies to ``rows``."""
    N, p = A.shape[0], 0
    for c in range(first, last):
        own = c * N * varied
        row = min(clock[c], control_set.shape[0] - 1)
        for i in range(N):
            v = control_set[row, i]
            for k in range(len(state_axes)):
                rows[0, p], rows[1, p], rows[2, p] = A[i, k, k], B[i, k, k], root[own + i, k, k]
                rows[3, p], rows[4, p] = -np.inf, np.inf
                if projection[v] == BOX:
                    rows[3, p], rows[4, p] = limits[0, v, k], limits[1, v, k]
                rows[5, p] = goal[own + i, k]
                rows[6, p] = tolerance[i, k] if k < goal_size[i] else np.inf
                p += 1


@njit(cache=True)
def move_apart(
    first, last, state_axes, rows, state, status, parked, clock, action, noise, schedule, scheduled,
    lam, effort, arrived, time_cost,
):  # fmt: skip
    """Move agents in traffic by x' = A x + B u + root noise, with diagonal matrices.

    Charge time and effort, which is that of the applied input u, and flag arrivals.
    """
    N, n = status.shape[1], len(state_axes)
    a, b, root, low, high, goal, width = (
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6],
    )  # fmt: skip
    codes, costs = status[first:last].reshape(-1), time_cost[first:last].reshape(-1)
    weights, there = lam[first:last].reshape(-1), arrived[first:last].reshape(-1)
    asked, fresh = action[first:last].reshape(-1), _of_agents(noise[first:last], N)
    x = _of_agents(state[first:last], N)
    moving, costly = np.empty(x.size, np.bool_), False
    for i in range(N):
        costly = costly or effort[i] > 0.0
    for p in range(codes.size):
        moves = codes[p] == TRAFFIC
        costs[p] = weights[p] if moves else 0.0
        for k in range(n):
            moving[p * n + k] = moves
    if costly:
        for p in range(codes.size):
            total = 0.0
            for q in range(p * n, p * n + n):
                total += abs(min(max(asked[q], low[q]), high[q]))
            if codes[p] == TRAFFIC:
                costs[p] += effort[p % N] * total
    for q in range(x.size):
        value = a[q] * x[q] + root[q] * fresh[q]
        value = value + b[q] * min(max(asked[q], low[q]), high[q])
        x[q] = value if moving[q] else x[q]
    if state.shape[1] > N:
        for p in range(codes.size):
            for k in range(n):
                state[first + p // N, p % N, k] = x[p * n + k]
    for q in range(x.size):
        moving[q] = moving[q] & (scheduled | (abs(x[q] - goal[q]) <= width[q]))
    for p in range(codes.size):
        every = True
        for k in range(n):
            every = every & moving[p * n + k]
        there[p] = every
    _park(first, last, status, parked, clock, schedule, scheduled, arrived)


@njit(inline="always")
def _of_agents(values, N):
    """Return the rows of the first N bodies of all copies as one, a view if that is possible."""
    if values.shape[1] > N:
        return values[:, :N].copy().reshape(-1)
    return values.reshape(-1)


@njit(inline="always")
def _park(first, last, status, parked, clock, schedule, scheduled, arrived):
    """Advance the clock; park agents that have ``arrived``, on schedule not before their time."""
    for c in range(first, last):
        clock[c] += 1
        for i in range(status.shape[1]):
            if scheduled:
                arrived[c, i] = arrived[c, i] & (clock[c] >= schedule[i])
            if arrived[c, i]:
                status[c, i] = ARRIVED
                parked[c, i] = clock[c]


@njit(cache=True)
def move_coupled(
    varied, first, last, state_axes, input_axes, state, status, parked, clock, action, noise, A,
    B, root, control_set, projection, limits, edges, input_normals, input_offsets, first_row, goal,
    agent_codes, tolerance, scheduled, lam, effort, arrived, time_cost,
):  # fmt: skip
    """Do the same as :func:`move_apart`, whatever matrices and control sets are."""
    N, n, m = status.shape[1], len(state_axes), len(input_axes)
    goal_size, schedule, inputs = agent_codes[0], agent_codes[1], agent_codes[3]
    u, moved = np.empty(m), np.empty(n)
    for c in range(first, last):
        row, own = min(clock[c], control_set.shape[0] - 1), c * N * varied
        for i in range(N):
            arrived[c, i] = False
            if status[c, i] != TRAFFIC:
                time_cost[c, i] = 0.0
                continue
            v, asked = control_set[row, i], 0.0
            kind = projection[v]
            for k in range(m):
                u[k] = action[c, i, k] if k < inputs[i] else 0.0
                if kind == BOX:
                    u[k] = min(max(u[k], limits[0, v, k]), limits[1, v, k])
            if kind == POLYGON:
                project_on_polygon(edges, first_row[0, v], first_row[0, v + 1], u)
            elif kind == FACES:
                start, end = first_row[1, v], first_row[1, v + 1]
                project_on_faces(input_normals, input_offsets, start, end, u)
            for k in range(n):
                value = 0.0
                for q in range(n):
                    value += A[i, k, q] * state[c, i, q] + root[own + i, k, q] * noise[c, i, q]
                for q in range(m):
                    value += B[i, k, q] * u[q]
                moved[k] = value
            there = True
            for k in range(n):
                state[c, i, k] = moved[k]
                away = abs(moved[k] - goal[own + i, k])
                there = there & (scheduled | (k >= goal_size[i]) | (away <= tolerance[i, k]))
            for k in range(m):
                asked += abs(u[k])
            arrived[c, i] = there
            time_cost[c, i] = lam[c, i]
            if effort[i] > 0.0:
                time_cost[c, i] += effort[i] * asked
    _park(first, last, status, parked, clock, schedule, scheduled, arrived)


@njit(cache=True)
def move_obstacles(
    first, last, state_axes, state, agents, clock, noise, path, obstacle_times, root, drifting
):
    """Move obstacles along their paths; with noise they drift, by root noise per step to rest."""
    n, first_root = len(state_axes), root.shape[0] - path.shape[0]
    for c in range(first, last):
        for b in range(path.shape[0]):
            t, body = clock[c], agents + b
            if t > obstacle_times[b, 0]:
                continue
            for k in range(n):
                if not drifting:
                    state[c, body, k] = path[b, t, k]
                    continue
                state[c, body, k] += path[b, t, k] - path[b, t - 1, k]
                for q in range(n):
                    state[c, body, k] += root[first_root + b, k, q] * noise[c, body, q]
