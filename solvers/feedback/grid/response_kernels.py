"""Compiled: the best action of one agent at every joint grid state, against given moves.

Arguments are as in :mod:`solvers.feedback.grid.stage_kernels`.  Where the other agent ends in the
same state often, its stencil is summed once for all points of the agent, and so are overlaps if
they depend on ends alone.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from ppg_env.support.compilation import njit
from solvers.feedback.grid.end_groups import group_ends, mix, weighted
from solvers.feedback.grid.stage_kernels import best_move, exposed, is_near, overlap, stencil

GROUPS, OFTEN = 64, 16
"""States after its move that a given player has against one grid point of its own, and the number
of the agent's points from which one of them is prepared for all."""


@njit(cache=True, parallel=True)
def respond(field, side, risk, own_first, crash, lam, reach, low, step, shape, points, other_end,
            own_stays, other_stays, out, best):  # fmt: skip
    """Write the least cost of an agent against the other's given moves, and its actions.

    ``other_end`` (L, K or 1, 2) are the other's states after its move at each joint state, or at
    each of its own; on its grid (``low``, ``step``, ``shape``, ``points``).  ``own_stays`` (K,) and
    ``other_stays`` (L,) are probabilities of no arrival at grid points.
    """
    inner = side.index.shape[2] == 1 and not risk.swept
    for z in prange(out.shape[0]):
        index, weight = np.empty(16, np.int64), np.empty(16)
        w0, w1, values = np.empty(4), np.empty(4), np.empty(side.cost.shape[1], np.float32)
        mixed = np.empty(out.shape[1], np.float32)
        ends, size = other_end[z], out.shape[1]
        group, kept = np.empty(size, np.int64), np.empty(GROUPS, np.int64)
        uses = group_ends(ends, group, kept)
        rows, row_stays = np.empty((uses.size, size), np.float32), np.empty(uses.size)
        for g in range(uses.size):
            if uses[g] >= OFTEN:
                end = ends[kept[g]]
                count = stencil(low, step, shape, end[0], end[1], w0, w1, index, weight)
                row_stays[g] = weighted(other_stays, index, weight, count)
                mix(field, index, weight, count, rows[g])
                if inner:
                    add_overlaps(rows[g], side.points, own_stays, risk, own_first, crash, end,
                                 row_stays[g])  # fmt: skip
        for x in range(size):
            g = group[x]
            if g >= 0 and uses[g] >= OFTEN and inner:
                a, value = least_move(rows[g], side.index[x], side.cost[x])
                out[z, x], best[z, x] = value + lam, a
                continue
            end = ends[kept[g]] if g >= 0 else ends[x]
            near = is_near(risk, own_first, side.points[x], points[z], reach[x], end)
            if g >= 0 and uses[g] >= OFTEN:
                source, count, stays = rows, 1, row_stays[g]
                index[0], weight[0] = g, 1.0
            else:
                source = field
                count = stencil(low, step, shape, end[0], end[1], w0, w1, index, weight)
                stays = weighted(other_stays, index, weight, count) if near else 0.0
            a, value = best_move(source, side, risk, own_first, crash, x, points[z], index[:count],
                                 weight[:count], end, stays, near, values, mixed)  # fmt: skip
            out[z, x], best[z, x] = value + lam, a


@njit(cache=True)
def least_move(row, index, cost):
    """Return the action of the least cost after moves to grid points, and that cost."""
    chosen, least = 0, np.float32(np.inf)
    for a in range(cost.size):
        value = row[np.uint32(index[a, 0])] + cost[a]
        if value < least:
            chosen, least = a, value
    return chosen, least


@njit(cache=True)
def add_overlaps(row, points, own_stays, risk, own_first, crash, end, other_stays):
    """Add to costs (K,) after moves of an agent to grid points what overlaps cost there."""
    for k in range(row.size):
        p = overlap(risk, own_first, points[k], end, points[k], end)
        if p > 0.0:
            p *= exposed(risk, own_stays[k], other_stays)
            row[k] += p * (crash - (row[k] if risk.removes else 0.0))
