"""Compiled: the choice of actions of one agent without others, on a grid of up to four axes.

A field holds the expected cost to go after a move, before the noise, as if there were no obstacles.
With y = A x + B u the cost of the action u at x is

    C + p s (c - r C) + e,    C = field(y),    p = Pr(crash with an obstacle | x, y),

with s the probability of no arrival, c the crash cost, r = 1 if crashed agents leave the game, and
e the effort.  Values between grid points are cubic convolutions over 256 points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from ppg_env.support.compilation import njit
from solvers.feedback.grid.cubic import keys_weights
from solvers.feedback.grid.event_table import chance
from solvers.feedback.grid.look_ahead import REFINEMENTS, SHORTEST, limit
from solvers.feedback.grid.way_back import way_back


class Mover(NamedTuple):
    """One agent: its grid, dynamics, control set, actions and chance of arrival.

    low, step, shape, stride (4,): the grid, whose last axis is contiguous; A (4, 4), B (4, m);
    normals, offsets: faces of the control set; actions (A, m); spacing (m,): between actions;
    effort; stays (K,): probability of no arrival; crash: cost of a crash; back (4,): cost per unit
    of distance of the way back to the grid.
    """

    low: np.ndarray
    step: np.ndarray
    shape: np.ndarray
    stride: np.ndarray
    A: np.ndarray
    B: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    actions: np.ndarray
    spacing: np.ndarray
    effort: float
    stays: np.ndarray
    crash: float
    back: np.ndarray


@njit(cache=True)
def place(mover, y, at, weight):
    """Write the numbers (4, 4) of the stencil of ``y`` along each axis, and its weights."""
    for k in range(4):
        last = mover.shape[k] - 1
        cells = min(max((y[k] - mover.low[k]) / mover.step[k], 0.0), float(last))
        cell = min(int(cells), max(last - 1, 0))
        keys_weights(cells - cell, weight[k])
        for r in range(4):
            at[k, r] = min(max(cell + r - 1, 0), last) * mover.stride[k]


@njit(cache=True)
def weigh(values, at, weight):
    """Return the interpolant of ``values`` (K,) over a stencil."""
    total = 0.0
    for i in range(4):
        if weight[0, i] == 0.0:
            continue
        for j in range(4):
            first = weight[0, i] * weight[1, j]
            if first == 0.0:
                continue
            part = 0.0
            for k in range(4):
                if weight[2, k] == 0.0:
                    continue
                row, inner = at[0, i] + at[1, j] + at[2, k], 0.0
                for q in range(4):
                    inner += weight[3, q] * values[row + at[3, q]]
                part += weight[2, k] * inner
            total += first * part
    return total


@njit(cache=True)
def price(mover, harm, field, x, base, u, y, at, weight):
    """Return the cost of the action ``u`` at state ``x``, without that of the step's time."""
    cost = 0.0
    for k in range(4):
        y[k] = base[k]
        for q in range(u.size):
            y[k] += mover.B[k, q] * u[q]
    for q in range(u.size):
        cost += mover.effort * abs(u[q])
    place(mover, y, at, weight)
    value = weigh(field, at, weight) + way_back(mover, y)
    if not harm.empty:
        p = chance(harm, x[0], x[1], y[0], y[1])
        if p > 0.0:
            p *= weigh(mover.stays, at, weight)
            value += p * (mover.crash - value if harm.removes else mover.crash)
    return value + cost


@njit(cache=True)
def point(mover, number, x):
    """Write the state (4,) of a grid point."""
    rest = number
    for k in range(4):
        x[k] = mover.low[k] + mover.step[k] * (rest // mover.stride[k])
        rest %= mover.stride[k]


@njit(cache=True)
def drift(mover, x, base):
    """Write base = A x."""
    for k in range(4):
        base[k] = 0.0
        for q in range(4):
            base[k] += mover.A[k, q] * x[q]


@njit(cache=True)
def least(mover, harm, field, x, base, y, at, weight):
    """Return the best of the set of actions, and its cost."""
    chosen, lowest = 0, np.inf
    for a in range(mover.actions.shape[0]):
        value = price(mover, harm, field, x, base, mover.actions[a], y, at, weight)
        if value < lowest:
            chosen, lowest = a, value
    return chosen, lowest


@njit(cache=True, parallel=True)
def step_back(mover, harm, field, lam, out):
    """Write the least cost (K,) of the stage at every grid state."""
    for number in prange(out.size):
        x, base, y = np.empty(4), np.empty(4), np.empty(4)
        at, weight = np.empty((4, 4), np.int64), np.empty((4, 4))
        point(mover, number, x)
        drift(mover, x, base)
        out[number] = least(mover, harm, field, x, base, y, at, weight)[1] + lam


@njit(cache=True, parallel=True)
def decide(mover, harm, field, states, actions):
    """Write the best actions (C, m) at ``states`` (C, 4): of the set, then with finer steps."""
    for c in prange(states.shape[0]):
        base, y = np.empty(4), np.empty(4)
        u, middle = np.empty(actions.shape[1]), np.empty(actions.shape[1])
        at, weight = np.empty((4, 4), np.int64), np.empty((4, 4))
        x, best = states[c], actions[c]
        drift(mover, x, base)
        chosen, lowest = least(mover, harm, field, x, base, y, at, weight)
        best[:] = mover.actions[chosen]
        around = 3**u.size
        for trial in range(REFINEMENTS * around):
            if trial % around == 0:
                middle[:] = best
            rest, size = trial % around, 0.5 ** (trial // around + 1)
            for q in range(u.size):
                u[q] = (rest % 3 - 1) * mover.spacing[q] * size
                rest //= 3
            room = limit(mover, middle, u)
            if room < SHORTEST:
                continue
            u[:] = middle + room * u
            value = price(mover, harm, field, x, base, u, y, at, weight)
            if value < lowest:
                lowest = value
                best[:] = u


@njit(cache=True)
def value_at(mover, values, state):
    """Return the interpolant of ``values`` (K,) at ``state`` (4,)."""
    at, weight = np.empty((4, 4), np.int64), np.empty((4, 4))
    place(mover, state, at, weight)
    return weigh(values, at, weight)
