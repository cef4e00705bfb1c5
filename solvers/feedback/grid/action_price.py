"""Compiled: the cost of an action by one-step look-ahead.

Cubic convolution is used in all four dimensions, and the table of overlaps for crashes
(:mod:`solvers.feedback.grid.stage_kernels` has the formula).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ppg_env.support.compilation import njit
from solvers.feedback.grid.cubic import keys_weights
from solvers.feedback.grid.event_table import chance
from solvers.feedback.grid.stage_kernels import exposed, overlap
from solvers.feedback.grid.way_back import way_back


class Cells(NamedTuple):
    """A grid of two axes: low, step, shape (2,)."""

    low: np.ndarray
    step: np.ndarray
    shape: np.ndarray


class Body(NamedTuple):
    """One agent: its grid, dynamics, control set, actions and chance of arrival.

    low, step, shape (2,): the grid; A (2, 2), B (2, m); normals, offsets: faces of the control
    set; actions (A, m); span (2, 2): lowest and highest B u; spacing (m,): between actions;
    effort; stays (n0, n1): probability of no arrival; crash: cost of a crash; share: the agent's
    part of the costs in the field; back (2,): cost per unit of distance of the way back to the
    grid; finer_low, finer_step, finer_shape (2,), gap (f0, f1): difference of its
    costs alone on a finer grid; no points if there is none.
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
    finer_low: np.ndarray
    finer_step: np.ndarray
    finer_shape: np.ndarray
    gap: np.ndarray


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


@njit(cache=True)
def change(low, step, shape, gap, y, w0, w1):
    """Return the interpolant at ``y`` of ``gap`` on a grid; a call of its own compiles once."""
    return read(Cells(low, step, shape), gap, 0, 0, y, w0, w1)


@njit(cache=True, inline="always")
def price(body, harm, window, i0, j0, risk, own_first, crash, x, base, u, y, other, w0, w1):
    """Return the cost of the action ``u`` at state ``x``.

    ``other`` (5,): the other's states before and after its move, and its probability of no
    arrival, negative without another agent.
    """
    advance(body, base, u, y)
    value = read(body, window, i0, j0, y, w0, w1) + way_back(body, y)
    if body.gap.size > 0:
        value += change(body.finer_low, body.finer_step, body.finer_shape, body.gap, y, w0, w1)
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
def subtract_interpolant(gap, finer, cells, values):
    """Subtract from ``gap``, on the grid ``finer``, the interpolant of ``values`` on ``cells``."""
    w0, w1, y = np.empty(4), np.empty(4), np.empty(2)
    for i in range(gap.shape[0]):
        for j in range(gap.shape[1]):
            y[0] = finer.low[0] + i * finer.step[0]
            y[1] = finer.low[1] + j * finer.step[1]
            gap[i, j] -= read(cells, values, 0, 0, y, w0, w1)
