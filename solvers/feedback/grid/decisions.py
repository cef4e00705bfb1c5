"""Compiled: decisions at many states, which are independent of each other and made in parallel.

What a loop in parallel does at one state is a function of its own: the compiler is many times
faster with it, and compiles it once.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from ppg_env.support.compilation import njit
from solvers.feedback.grid.action_price import advance
from solvers.feedback.grid.look_ahead import refine, respond_to, search
from solvers.feedback.grid.stage_kernels import NO, YES, ZERO

SWEEPS = 3
"""Most actions that are chosen in turn, per agent, for one joint decision."""


@njit(cache=True, parallel=True)
def respond_everywhere(body, harm, field, own_first, risk, crash, far, states, far_states, far_ends,
                       size, actions):  # fmt: skip
    """Write the best actions (C, m) at ``states`` (C, 2), given where the other goes (C, 2)."""
    for c in prange(states.shape[0]):
        _respond_at(body, harm, field, own_first, risk, crash, far, states[c], far_states[c],
                    far_ends[c], size, actions[c])  # fmt: skip


@njit(cache=True)
def _respond_at(body, harm, field, own_first, risk, crash, far, state, far_state, far_end, size,
                action):  # fmt: skip
    """Write the best action (m,) at ``state`` (2,)."""
    w0, w1, base = np.empty(4), np.empty(4), np.empty(2)
    index, weight = np.empty(16, np.int64), np.empty(16)
    window = np.empty((size[0], size[1]))
    base[:] = body.A @ state
    action[:] = body.actions[0]
    respond_to(body, harm, field, own_first, risk, crash, state, base, far, far_state, far_end,
               YES, YES, w0, w1, index, weight, window, action)  # fmt: skip


@njit(cache=True, parallel=True)
def decide_jointly(
    first, second, first_harm, second_harm, first_field, second_field, crash, risk, choice, states,
    size, one, two,
):  # fmt: skip
    """Write the actions ``one``, ``two`` (C, m) of both agents at ``states`` (C, 2, 2).

    They start as those of the nearest grid state; then each agent in turn takes the best of its
    set on its field (K0, K1), until neither gains.  Where they go on, the pair of least regret that
    was met is taken.  Both are refined last.
    """
    for c in prange(states.shape[0]):
        _decide_at(first, second, first_harm, second_harm, first_field, second_field, crash, risk,
                   choice, states[c], size, one[c], two[c])  # fmt: skip


@njit(cache=True)
def _decide_at(
    first, second, first_harm, second_harm, first_field, second_field, crash, risk, choice, state,
    size, one, two,
):  # fmt: skip
    """Write the actions ``one``, ``two`` (m,) of both agents at ``state`` (2, 2)."""
    w0, w1 = np.empty(4), np.empty(4)
    index, weight = np.empty(16, np.int64), np.empty(16)
    window = np.empty((size[0], size[1]))
    base, y, z = np.empty((2, 2)), np.empty(2), np.empty(2)
    base[0] = first.A @ state[0]
    base[1] = second.A @ state[1]
    i, j = nearest(first, state[0]), nearest(second, state[1])
    one[:] = first.actions[choice[0, i, j]]
    two[:] = second.actions[choice[1, i, j]]
    best_one, best_two, least, turn = one.copy(), two.copy(), np.inf, 0
    advance(second, base[1], two, z)
    # The last two turns refine the actions of both.
    while turn < 2 * SWEEPS + 2:
        coarse = turn < 2 * SWEEPS
        if turn == 2 * SWEEPS:
            one[:], two[:] = best_one, best_two
            advance(second, base[1], two, z)
        if coarse:
            was_one, was_two = one.copy(), two.copy()
        if turn % 2 == 0:
            gain = respond_to(first, first_harm, first_field, YES, risk, crash[0], state[0],
                              base[0], second, state[1], z, coarse, not coarse, w0, w1, index,
                              weight, window, one)  # fmt: skip
            advance(first, base[0], one, y)
        else:
            gain = respond_to(second, second_harm, second_field, NO, risk, crash[1], state[1],
                              base[1], first, state[0], y, coarse, not coarse, w0, w1, index,
                              weight, window, two)  # fmt: skip
            advance(second, base[1], two, z)
        # The other agent has just answered, so that the gain is the regret of the pair before.
        if coarse and turn > 0 and gain < least:
            best_one[:], best_two[:], least = was_one, was_two, gain
        turn += 1
        if coarse and turn > 1 and gain <= 0.0:
            turn = 2 * SWEEPS


@njit(cache=True, parallel=True)
def decide_alone(body, harm, alone, risk, states, actions):
    """Write the best actions (C, m) of an agent alone; ``alone`` (n0, n1) are its costs."""
    for c in prange(states.shape[0]):
        _decide_alone_at(body, harm, alone, risk, states[c], actions[c])


@njit(cache=True)
def _decide_alone_at(body, harm, alone, risk, state, action):
    """Write the best action (m,) of an agent alone at ``state`` (2,)."""
    w0, w1, base, other = np.empty(4), np.empty(4), np.empty(2), np.full(5, -1.0)
    base[:] = body.A @ state
    action[:] = body.actions[0]
    search(body, harm, alone, ZERO, ZERO, risk, YES, 0.0, state, base, other, w0, w1, action)
    refine(body, harm, alone, ZERO, ZERO, risk, YES, 0.0, state, base, other, w0, w1, action)


@njit(cache=True)
def nearest(body, state):
    """Return the number of the grid point nearest to ``state``."""
    i = int(np.rint(min(max((state[0] - body.low[0]) / body.step[0], 0.0), body.shape[0] - 1.0)))
    j = int(np.rint(min(max((state[1] - body.low[1]) / body.step[1], 0.0), body.shape[1] - 1.0)))
    return i * body.shape[1] + j
