"""Compiled: actions by one-step look-ahead on the fields of a stage, from any states.

The field of an agent is contracted over the other's stencil to the window of grid points that the
agent can reach; its actions are then compared on this window, first all of a set, then with finer
steps around the best.  Cubic convolution is used in all four dimensions, and the table of overlaps
for crashes (:mod:`solvers.feedback.grid.stage_kernels` has the formula).  ``harm`` are
crashes with obstacles, over positions of the agent, and ``risk`` those with the other agent.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ppg_env.support.compilation import njit
from solvers.feedback.grid.cubic import keys_weights
from solvers.feedback.grid.event_table import chance
from solvers.feedback.grid.stage_kernels import exposed, is_near, overlap, stencil
from solvers.feedback.grid.way_back import way_back

REFINEMENTS = 3
"""Halvings of the distance between actions."""

SHORTEST = 0.1
"""A smaller part of a shift to the border of the control set is not tried."""


class Body(NamedTuple):
    """One agent: its grid, dynamics, control set, actions and chance of arrival.

    low, step, shape (2,): the grid; A (2, 2), B (2, m); normals, offsets: faces of the control
    set; actions (A, m); span (2, 2): lowest and highest B u; spacing (m,): between actions;
    effort; stays (n0, n1): probability of no arrival; crash: cost of a crash; share: the agent's
    part of the costs in the field; back (2,): cost per unit of distance of the way back to the
    grid.
    """

    low: np.ndarray
    step: np.ndarray
    shape: np.ndarray
    A: np.ndarray
    B: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    actions: np.ndarray
    span: np.ndarray
    spacing: np.ndarray
    effort: float
    stays: np.ndarray
    crash: float
    share: float
    back: np.ndarray


@njit(cache=True, inline="always")
def advance(body, base, u, y):
    """Write y = base + B u."""
    for k in range(2):
        y[k] = base[k]
        for q in range(u.size):
            y[k] += body.B[k, q] * u[q]


@njit(cache=True, inline="always")
def read(body, window, i0, j0, y, w0, w1):
    """Return the interpolant at ``y`` of values on the window that begins at (i0, j0)."""
    a = min(max((y[0] - body.low[0]) / body.step[0], 0.0), body.shape[0] - 1.0)
    b = min(max((y[1] - body.low[1]) / body.step[1], 0.0), body.shape[1] - 1.0)
    i, j = min(int(a), max(body.shape[0] - 2, 0)), min(int(b), max(body.shape[1] - 2, 0))
    keys_weights(a - i, w0)
    keys_weights(b - j, w1)
    value = 0.0
    if 0 < i < body.shape[0] - 2 and 0 < j < body.shape[1] - 2:
        row, column = i - 1 - i0, j - 1 - j0
        for r in range(4):
            part = w1[0] * window[row + r, column] + w1[1] * window[row + r, column + 1]
            part += w1[2] * window[row + r, column + 2] + w1[3] * window[row + r, column + 3]
            value += w0[r] * part
    else:
        for r in range(4):
            row, part = min(max(i + r - 1, 0), body.shape[0] - 1) - i0, 0.0
            for s in range(4):
                part += w1[s] * window[row, min(max(j + s - 1, 0), body.shape[1] - 1) - j0]
            value += w0[r] * part
    return value


@njit(cache=True, inline="always")
def price(body, harm, window, i0, j0, risk, own_first, crash, x, base, u, y, other, w0, w1):
    """Return the cost of the action ``u`` at state ``x``.

    ``other`` (5,): the other's states before and after its move, and its probability of no
    arrival, negative without another agent.
    """
    advance(body, base, u, y)
    value = read(body, window, i0, j0, y, w0, w1) + way_back(body, y)
    lost, stays = 0.0, -1.0
    if other[4] >= 0.0:
        p = overlap(risk, own_first, x, other[:2], y, other[2:4])
        if p > 0.0:
            stays = read(body, body.stays, 0, 0, y, w0, w1)
            lost += p * exposed(risk, stays, other[4]) * (crash - value if risk.removes else crash)
    if not harm.empty:
        p = chance(harm, x[0], x[1], y[0], y[1])
        if p > 0.0:
            if stays < 0.0:
                stays = read(body, body.stays, 0, 0, y, w0, w1)
            lost += p * stays * (body.crash - body.share * value if risk.removes else body.crash)
    value += lost
    if body.effort > 0.0:
        for q in range(u.size):
            value += body.effort * abs(u[q])
    return value


@njit(cache=True)
def search(body, harm, window, i0, j0, risk, own_first, crash, x, base, other, w0, w1, best):
    """Write the best action of the set."""
    m, least, chosen = best.size, np.inf, 0
    y, u = np.empty(2), np.empty(m)
    for a in range(body.actions.shape[0]):
        for q in range(m):
            u[q] = body.actions[a, q]
        value = price(body, harm, window, i0, j0, risk, own_first, crash, x, base, u, y, other, w0,
                      w1)  # fmt: skip
        if value < least:
            least, chosen = value, a
    for q in range(m):
        best[q] = body.actions[chosen, q]


@njit(cache=True)
def refine(body, harm, window, i0, j0, risk, own_first, crash, x, base, other, w0, w1, best):
    """Write the best action near ``best``."""
    m, least = best.size, np.inf
    y, u, middle = np.empty(2), np.empty(m), np.empty(m)
    around = 3**m
    # The first action is ``best`` itself, then come those around it at each level.
    for k in range(-1, REFINEMENTS * around):
        code, size = k % around, 0.5 ** (k // around + 1)
        if k >= 0 and code == around // 2:
            continue
        first, rest = k < 0 or code == 0, code
        for q in range(m):
            if first:
                middle[q] = best[q]
            u[q] = (rest % 3 - 1) * body.spacing[q] * size if k >= 0 else 0.0
            rest //= 3
        room = limit(body, middle, u)
        if room < SHORTEST:
            continue
        for q in range(m):
            u[q] = middle[q] + room * u[q]
        value = price(body, harm, window, i0, j0, risk, own_first, crash, x, base, u, y, other, w0,
                      w1)  # fmt: skip
        if value < least:
            least = value
            for q in range(m):
                best[q] = u[q]


@njit(cache=True, inline="always")
def limit(body, middle, shift):
    """Return the part, up to 1, of ``shift`` that leads from ``middle`` to the set's border."""
    room = 1.0
    for f in range(body.offsets.size):
        along, left = 0.0, body.offsets[f]
        for q in range(shift.size):
            along += body.normals[f, q] * shift[q]
            left -= body.normals[f, q] * middle[q]
        if along > 1e-12:
            room = min(room, max(left, 0.0) / along)
    return room


@njit(cache=True)
def contract(body, field, own_first, base, far, at, w0, w1, index, weight, window):
    """Write the field at the other's state ``at`` to the window in reach; return its corner."""
    count = stencil(far.low, far.step, far.shape, at[0], at[1], w0, w1, index, weight)
    edge = np.empty((2, 2), np.int64)
    for k in range(2):
        last = body.shape[k] - 1
        for side in range(2):
            place = (base[k] + body.span[side, k] - body.low[k]) / body.step[k]
            place = min(max(place, 0.0), float(last))
            cell = min(int(place), max(last - 1, 0))
            edge[side, k] = max(cell - 1, 0) if side == 0 else min(cell + 2, last)
    i0, j0 = edge[0, 0], edge[0, 1]
    for i in range(i0, edge[1, 0] + 1):
        for j in range(j0, edge[1, 1] + 1):
            k, value = i * body.shape[1] + j, 0.0
            for t in range(count):
                if own_first:
                    value += weight[t] * field[k, index[t]]
                else:
                    value += weight[t] * field[index[t], k]
            window[i - i0, j - j0] = value
    return i0, j0


@njit(cache=True)
def respond_to(body, harm, field, own_first, risk, crash, x, base, far, far_x, far_y, coarse,
               finer, w0, w1, index, weight, window, best):  # fmt: skip
    """Write the best action of ``body`` when the other agent ``far`` goes from x to y."""
    i0, j0 = contract(body, field, own_first, base, far, far_y, w0, w1, index, weight, window)
    other, reach = np.empty(5), np.empty(4)
    for k in range(2):
        other[k], other[2 + k] = far_x[k], far_y[k]
        reach[k], reach[2 + k] = base[k] + body.span[0, k], base[k] + body.span[1, k]
    other[4] = -1.0
    if is_near(risk, own_first, x, far_x, reach, far_y):
        other[4] = max(read(far, far.stays, 0, 0, far_y, w0, w1), 0.0)
    if coarse:
        search(body, harm, window, i0, j0, risk, own_first, crash, x, base, other, w0, w1, best)
    if finer:
        refine(body, harm, window, i0, j0, risk, own_first, crash, x, base, other, w0, w1, best)
