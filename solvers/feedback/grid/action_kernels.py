"""Compiled: costs of given actions on the fields of a stage; arguments are as in ``look_ahead``."""

from __future__ import annotations

import numpy as np

from ppg_env.support.compilation import njit
from solvers.feedback.grid.action_price import price, read
from solvers.feedback.grid.look_ahead import contract
from solvers.feedback.grid.stage_kernels import YES, ZERO, is_near


@njit(cache=True)
def price_alone(body, harm, alone, risk, states, actions, out):
    """Write the costs (C, K) of ``actions`` (C, K, m) of an agent alone at ``states`` (C, 2)."""
    for c in range(states.shape[0]):
        w0, w1, base, y = np.empty(4), np.empty(4), np.empty(2), np.empty(2)
        other = np.full(5, -1.0)
        base[:] = body.A @ states[c]
        for k in range(actions.shape[1]):
            out[c, k] = price(body, harm, alone, ZERO, ZERO, risk, YES, 0.0, states[c], base,
                              actions[c, k], y, other, w0, w1)  # fmt: skip


@njit(cache=True)
def price_together(body, harm, field, own_first, risk, crash, far, states, far_states, far_ends,
                    size, actions, out):  # fmt: skip
    """Write the costs (C, K) of ``actions`` (C, K, m), given where the other goes (C, 2)."""
    for c in range(states.shape[0]):
        w0, w1, base, y = np.empty(4), np.empty(4), np.empty(2), np.empty(2)
        index, weight = np.empty(16, np.int64), np.empty(16)
        window, other, reach = np.empty((size[0], size[1])), np.empty(5), np.empty(4)
        base[:] = body.A @ states[c]
        i0, j0 = contract(body, field, own_first, base, far, far_ends[c], w0, w1, index, weight,
                          window)  # fmt: skip
        for k in range(2):
            other[k], other[2 + k] = far_states[c, k], far_ends[c, k]
            reach[k], reach[2 + k] = base[k] + body.span[0, k], base[k] + body.span[1, k]
        other[4] = -1.0
        if is_near(risk, own_first, states[c], far_states[c], reach, far_ends[c]):
            other[4] = max(read(far, far.stays, 0, 0, far_ends[c], w0, w1), 0.0)
        for k in range(actions.shape[1]):
            out[c, k] = price(body, harm, window, i0, j0, risk, own_first, crash, states[c], base,
                              actions[c, k], y, other, w0, w1)  # fmt: skip
