"""Compiled: actions by one-step look-ahead on the fields of a stage, from any states.

The field of an agent is contracted over the other's stencil to the window of grid points that the
agent can reach; its actions are then compared on this window
(:mod:`solvers.feedback.grid.action_price`), first all of a set, then with finer steps around the
best.  ``harm`` are crashes with obstacles, over positions of the agent, and ``risk`` those with the
other agent.
"""

from __future__ import annotations

import numpy as np

from ppg_env.support.compilation import njit
from solvers.feedback.grid.action_price import price, read
from solvers.feedback.grid.stage_kernels import is_near, stencil

REFINEMENTS = 3
"""Halvings of the distance between actions."""

SHORTEST = 0.1
"""A smaller part of a shift to the border of the control set is not tried."""


@njit(cache=True)
def search(body, harm, window, i0, j0, risk, own_first, crash, x, base, other, w0, w1, best):
    """Write the best action of the set; return by how much it is better than ``best`` was.

    ``best`` must be in the control set before: the window ends where its actions lead.
    """
    m, least, chosen = best.size, np.inf, 0
    y, u = np.empty(2), np.empty(m)
    before = price(body, harm, window, i0, j0, risk, own_first, crash, x, base, best, y, other, w0,
                   w1)  # fmt: skip
    for a in range(body.actions.shape[0]):
        for q in range(m):
            u[q] = body.actions[a, q]
        value = price(body, harm, window, i0, j0, risk, own_first, crash, x, base, u, y, other, w0,
                      w1)  # fmt: skip
        if value < least:
            least, chosen = value, a
    for q in range(m):
        best[q] = body.actions[chosen, q]
    return before - least


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
    """Write the best action of ``body`` when the other agent ``far`` goes from x to y.

    Return by how much an action of the set is better than ``best`` was, if they are compared.
    """
    i0, j0 = contract(body, field, own_first, base, far, far_y, w0, w1, index, weight, window)
    other, reach = np.empty(5), np.empty(4)
    for k in range(2):
        other[k], other[2 + k] = far_x[k], far_y[k]
        reach[k], reach[2 + k] = base[k] + body.span[0, k], base[k] + body.span[1, k]
    other[4] = -1.0
    if is_near(risk, own_first, x, far_x, reach, far_y):
        other[4] = max(read(far, far.stays, 0, 0, far_y, w0, w1), 0.0)
    gain = 0.0
    if coarse:
        gain = search(
            body, harm, window, i0, j0, risk, own_first, crash, x, base, other, w0, w1, best
        )
    if finer:
        refine(body, harm, window, i0, j0, risk, own_first, crash, x, base, other, w0, w1, best)
    return gain
