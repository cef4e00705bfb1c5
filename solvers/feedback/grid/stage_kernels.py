"""Compiled: the choice of actions at every joint grid state of one stage.

A field holds the expected cost to go of one agent after both have moved, before the noise, as if
no bodies could overlap in this step: ``field[k, l]`` at point k of one agent and l of the other.
With y the states after the moves, the cost of a pair of actions is

    C + p (c - r C) + e,    C = field(y),    p = Pr(overlap | x, y) s,

with s the probability that neither agent arrives, or, where bodies stay, not both; c the crash
cost, r = 1 if crashed agents leave the game, and e the cost of the agent's own action: effort, and
crashes with obstacles.  States are independent of each other, so results do not depend on the
number of threads.

``risk`` is the table of overlaps over displacements of agent 0 from agent 1. ``Side`` holds what
one agent can do at its K grid points, with A actions and stencils of S points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from ppg_env.support.compilation import njit
from solvers.feedback.grid.cubic import keys_weights
from solvers.feedback.grid.event_table import bilinear, chance, swept_chance

YES, NO, ZERO = np.bool_(True), np.bool_(False), np.int64(0)
"""Literals have types of their own, for which the functions called would be compiled again."""


class Side(NamedTuple):
    """Moves of one agent as arrays.

    index, weight (K, A, S): stencils of the states after a move; ends (K, A, 2): those states;
    stays (K, A): probability of no arrival; cost (K, A): effort and obstacles; points (K, 2):
    states before the move; window (K, 4): first and last row, first and last column of the grid
    points of all stencils; columns: number of columns of the grid.
    """

    index: np.ndarray  # type: ignore[assignment]  # tuples have a method of this name
    weight: np.ndarray
    ends: np.ndarray
    stays: np.ndarray
    cost: np.ndarray
    points: np.ndarray
    window: np.ndarray
    columns: int


@njit(cache=True)
def exposed(risk, own_stays, other_stays):
    """Return the probability that an overlap counts: no arrival, or not two where bodies stay."""
    both = own_stays * other_stays
    return own_stays + other_stays - both if risk.parks else both


@njit(cache=True)
def overlap(risk, own_first, own_before, other_before, own, other):
    """Return the probability of an overlap for states before and after the moves."""
    sign = 1.0 if own_first else -1.0
    return chance(
        risk,
        sign * (own_before[0] - other_before[0]),
        sign * (own_before[1] - other_before[1]),
        sign * (own[0] - other[0]),
        sign * (own[1] - other[1]),
    )


@njit(cache=True)
def best_move(field, side, risk, own_first, crash, x, other_before, other_index, other_weight,
              other_end, other_stays, near, values, mixed):  # fmt: skip
    """Return the best action at grid point ``x`` and its cost, given where the other agent is.

    ``field`` is (other's points, own points); ``values`` (A,) and ``mixed`` (own points,), both
    float32, are room for costs of actions, and of the points that they lead to.
    """
    actions, taps = side.index.shape[1:]
    values[:] = side.cost[x]
    if taps == 1:
        for t in range(other_index.size):
            row, scale = field[other_index[t]], np.float32(other_weight[t])
            for a in range(actions):
                values[a] += scale * row[side.index[x, a, 0]]
    else:
        mix_window(field, side, x, other_index, other_weight, mixed)
        for a in range(actions):
            for s in range(taps):
                values[a] += side.weight[x, a, s] * mixed[side.index[x, a, s]]
    if near:
        add_crashes(side, risk, own_first, crash, x, other_before, other_end, other_stays, values)
    chosen = 0
    for a in range(1, actions):
        if values[a] < values[chosen]:
            chosen = a
    return chosen, values[chosen]


@njit(cache=True)
def mix_window(field, side, x, other_index, other_weight, mixed):
    """Write the field at the other's stencil to the points that moves from ``x`` lead to."""
    top, bottom, left, right = side.window[x]
    for r in range(top, bottom + 1):
        first, last = r * side.columns + left, r * side.columns + right + 1
        for k in range(first, last):
            mixed[k] = np.float32(0.0)
        for t in range(other_index.size):
            row, scale = field[other_index[t]], np.float32(other_weight[t])
            for k in range(first, last):
                mixed[k] += scale * row[k]


@njit(cache=True)
def add_crashes(side, risk, own_first, crash, x, other_before, other_end, other_stays, values):
    """Add to the costs (A,) of the actions at grid point ``x`` what overlaps cost."""
    ends, stays, cost, sign = side.ends, side.stays, side.cost, 1.0 if own_first else -1.0
    x0 = sign * (side.points[x, 0] - other_before[0])
    x1 = sign * (side.points[x, 1] - other_before[1])
    far0, far1, removes = other_end[0], other_end[1], risk.removes
    table, low, step = risk.values, risk.low, risk.step
    for a in range(values.size):
        y0, y1 = sign * (ends[x, a, 0] - far0), sign * (ends[x, a, 1] - far1)
        if risk.swept:
            p = swept_chance(risk, x0, x1, y0, y1)
        else:
            p = bilinear(table, (y0 - low[0]) / step[0], (y1 - low[1]) / step[1], False)
        p *= exposed(risk, stays[x, a], other_stays)
        if p > 0.0:  # interpolated probabilities can be negative
            values[a] += p * (crash - (values[a] - cost[x, a] if removes else 0.0))


@njit(cache=True)
def is_near(risk, own_first, before, other_before, reach, other_end):
    """Return whether an overlap is possible: ``reach`` (4,) are the lowest and highest ends."""
    sign, events = 1.0 if own_first else -1.0, risk
    for k in range(2):
        if events.swept:
            count = events.swept_values.shape[k]
            first, step = events.start_low[k], events.start_step[k]
            low = high = sign * (before[k] - other_before[k])
        else:
            count, first, step = events.values.shape[k], events.low[k], events.step[k]
            a, b = sign * (reach[k] - other_end[k]), sign * (reach[2 + k] - other_end[k])
            low, high = min(a, b), max(a, b)
        if count > 1 and (high < first or low > first + step * (count - 1)):
            return False
    return not events.empty


@njit(cache=True, parallel=True)
def erode(values, index, weight, cost, out, best):
    """Write the least ``values`` (K, L) over the moves along the first axis, and their actions."""
    points, actions, taps = index.shape
    width = values.shape[1]
    for x in prange(points):
        row, arg = out[x], best[x]
        row[:] = np.inf
        mixed = np.empty(width, np.float32)
        for a in range(actions):
            if taps == 1:
                source, effort = values[index[x, a, 0]], cost[x, a]
                for k in range(width):
                    value = source[k] + effort
                    if value < row[k]:
                        row[k] = value
                        arg[k] = a
                continue
            mixed[:] = cost[x, a]
            for s in range(taps):
                source, w = values[index[x, a, s]], weight[x, a, s]
                for k in range(width):
                    mixed[k] += w * source[k]
            for k in range(width):
                if mixed[k] < row[k]:
                    row[k] = mixed[k]
                    arg[k] = a


@njit(cache=True, parallel=True)
def settle(fields, first, second, risk, crash, lam, choice, out):
    """Write the costs (2, K1, K2) of both agents for the actions ``choice`` (2, K1, K2)."""
    for x in prange(out.shape[1]):
        for y in range(out.shape[2]):
            a, b = choice[0, x, y], choice[1, x, y]
            p = overlap(
                risk, YES, first.points[x], second.points[y], first.ends[x, a], second.ends[y, b]
            )
            p *= exposed(risk, first.stays[x, a], second.stays[y, b])
            for f in range(2):
                value = 0.0
                for s in range(first.index.shape[2]):
                    row, part = first.index[x, a, s], 0.0
                    for t in range(second.index.shape[2]):
                        part += second.weight[y, b, t] * fields[f, row, second.index[y, b, t]]
                    value += first.weight[x, a, s] * part
                value += p * (crash[f] - value if risk.removes else crash[f])
                effort = first.cost[x, a] if f == 0 else second.cost[y, b]
                out[f, x, y] = value + effort + lam[f]


@njit(cache=True)
def stencil(low, step, shape, first, second, w0, w1, index, weight):
    """Write the points and weights of the interpolant at (first, second); return their number."""
    a = min(max((first - low[0]) / step[0], 0.0), shape[0] - 1.0)
    b = min(max((second - low[1]) / step[1], 0.0), shape[1] - 1.0)
    i, j = min(int(a), max(shape[0] - 2, 0)), min(int(b), max(shape[1] - 2, 0))
    keys_weights(a - i, w0)
    keys_weights(b - j, w1)
    count = 0
    for r in range(4):
        row = min(max(i + r - 1, 0), shape[0] - 1) * shape[1]
        for s in range(4):
            w = w0[r] * w1[s]
            if w != 0.0:
                index[count] = row + min(max(j + s - 1, 0), shape[1] - 1)
                weight[count] = w
                count += 1
    return count


def reach_of(side: Side) -> np.ndarray:
    """Return (K, 4) lowest and highest states after a move from each grid point."""
    return np.concatenate([side.ends.min(axis=1), side.ends.max(axis=1)], axis=1)
