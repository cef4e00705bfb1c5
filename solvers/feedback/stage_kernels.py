"""Compiled: the choice of actions at every joint grid state of one stage.

A field holds the expected cost to go of one agent after both have moved, before the noise, as if
no bodies could overlap in this step: ``field[k, l]`` at point k of one agent and l of the other.
With y the states after the moves, the cost of a pair of actions is

    C + p (c - r C),    C = field(y),    p = Pr(overlap | y) s_1 s_2,

with s_i the probability that agent i does not arrive, c the crash cost, and r = 1 if crashed
agents leave the game.  States are independent of each other, so results do not depend on the
number of threads.

``Side`` holds what one agent can do at its K grid points, with A actions and stencils of S points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from solvers.feedback.cubic import keys_weights
from solvers.feedback.overlap_table import look_up

MOST_ROUNDS = 12
"""Best responses per state after which pairs of actions are enumerated."""


class Side(NamedTuple):
    """Moves of one agent as arrays.

    index, weight (K, A, S): stencils of the states after a move; ends (K, A, 2): those states;
    stays (K, A): probability of no arrival; cost (A,): effort.
    """

    index: np.ndarray
    weight: np.ndarray
    ends: np.ndarray
    stays: np.ndarray
    cost: np.ndarray


class Risk(NamedTuple):
    """The table of overlap probabilities, over displacements of agent 0 from agent 1."""

    low: np.ndarray
    step: np.ndarray
    values: np.ndarray
    removes: bool


@njit(cache=True, inline="always")
def overlap(risk, own_first, a, b):
    """Return the probability for states ``a`` of one agent and ``b`` of another."""
    first, second = a[0] - b[0], a[1] - b[1]
    if not own_first:
        first, second = -first, -second
    return look_up(risk.low, risk.step, risk.values, first, second)


@njit(cache=True)
def best_move(field, side, risk, own_first, crash, x, other_index, other_weight, other_end,
              other_stays, near):  # fmt: skip
    """Return the best action at grid point ``x`` and its cost, given where the other agent is.

    ``field`` is (other's points, own points).
    """
    best, chosen = np.inf, 0
    for a in range(side.index.shape[1]):
        value = 0.0
        for t in range(other_index.size):
            part = 0.0
            row = other_index[t]
            for s in range(side.index.shape[2]):
                part += side.weight[x, a, s] * field[row, side.index[x, a, s]]
            value += other_weight[t] * part
        if near:
            p = overlap(risk, own_first, side.ends[x, a], other_end) * side.stays[x, a]
            p *= other_stays
            value += p * (crash - value if risk.removes else crash)
        value += side.cost[a]
        if value < best:
            best, chosen = value, a
    return chosen, best


@njit(cache=True, inline="always")
def is_near(risk, own_first, reach, x, other_end):
    """Return whether any end in the box ``reach`` (K, 4) of point ``x`` can overlap."""
    sign = 1.0 if own_first else -1.0
    for k in range(2):
        a = sign * (reach[x, k] - other_end[k])
        b = sign * (reach[x, 2 + k] - other_end[k])
        low, high = min(a, b), max(a, b)
        if risk.values.shape[k] == 1:
            continue
        top = risk.low[k] + risk.step[k] * (risk.values.shape[k] - 1)
        if high < risk.low[k] or low > top:
            return False
    return True


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
                source, effort = values[index[x, a, 0]], cost[a]
                for k in range(width):
                    value = source[k] + effort
                    if value < row[k]:
                        row[k] = value
                        arg[k] = a
                continue
            mixed[:] = cost[a]
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
            p = overlap(risk, True, first.ends[x, a], second.ends[y, b])
            p *= first.stays[x, a] * second.stays[y, b]
            for f in range(2):
                value = 0.0
                for s in range(first.index.shape[2]):
                    row, part = first.index[x, a, s], 0.0
                    for t in range(second.index.shape[2]):
                        part += second.weight[y, b, t] * fields[f, row, second.index[y, b, t]]
                    value += first.weight[x, a, s] * part
                value += p * (crash[f] - value if risk.removes else crash[f])
                effort = first.cost[a] if f == 0 else second.cost[b]
                out[f, x, y] = value + effort + lam[f]


@njit(cache=True, parallel=True)
def respond(field, side, risk, own_first, crash, lam, reach, low, step, shape, other_end,
            other_stays, out, best):  # fmt: skip
    """Write the least cost of an agent against the other's given moves, and its actions.

    ``other_end`` (L, K, 2) are the other's states after its move at each joint state, on its grid
    (``low``, ``step``, ``shape``); ``other_stays`` (L,) its probability of no arrival.
    """
    for z in prange(out.shape[0]):
        index, weight = np.empty(16, np.int64), np.empty(16)
        w0, w1 = np.empty(4), np.empty(4)
        for x in range(out.shape[1]):
            end = other_end[z, x]
            count = stencil(low, step, shape, end[0], end[1], w0, w1, index, weight)
            near = is_near(risk, own_first, reach, x, end)
            stays = 1.0
            if near:
                stays = 0.0
                for t in range(count):
                    stays += weight[t] * other_stays[index[t]]
            a, value = best_move(field, side, risk, own_first, crash, x, index[:count],
                                 weight[:count], end, stays, near)  # fmt: skip
            out[z, x] = value + lam
            best[z, x] = a


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
