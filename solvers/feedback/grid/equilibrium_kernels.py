"""Compiled: equilibria of the game between two agents at every joint grid state of a stage.

Arguments are as in :mod:`solvers.feedback.grid.stage_kernels`.  Agents answer each other in turn,
from a given pair of actions, until no deviation gains more than the tolerance of the state.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from ppg_env.support.compilation import njit
from solvers.feedback.grid.stage_kernels import NO, YES, best_move, is_near

SLACK = 1e-4
"""A deviation that gains no more than this counts as none; without it, rounding makes actions of
equal cost alternate."""


@njit(cache=True, parallel=True)
def stage_equilibria(own_fields, other_fields, first, second, risk, crash, reach_first,
                     reach_second, swapped, rounds, tolerance, choice, regret):  # fmt: skip
    """Improve ``choice`` (2, K1, K2) in turn, up to ``rounds`` times; write the ``regret`` left.

    ``own_fields`` (K2, K1) is the first agent's field, ``other_fields`` (K1, K2) the second's.
    ``tolerance`` and ``regret`` (K1, K2) are of the larger gain by another action.  Where answers
    cycle, the pair of least regret that was met is chosen; the pair given is kept if no other has
    a regret that is smaller by more than the tolerance.
    """
    for x in prange(choice.shape[1]):
        _agree(own_fields, other_fields, first, second, risk, crash, reach_first, reach_second,
               swapped, rounds, tolerance, np.int64(x), choice, regret)  # fmt: skip


@njit(cache=True)
def _agree(own_fields, other_fields, first, second, risk, crash, reach_first, reach_second, swapped,
           rounds, tolerance, x, choice, regret):  # fmt: skip
    """Write the pairs of actions and their regrets at all states with the first agent at ``x``."""
    one = np.empty(first.cost.shape[1], np.float32)
    two = np.empty(second.cost.shape[1], np.float32)
    mixed = np.empty(max(choice.shape[1], choice.shape[2]), np.float32)
    for y in range(choice.shape[2]):
        a, b, limit = choice[0, x, y], choice[1, x, y], tolerance[x, y]
        best_a, best_b, least, left = a, b, np.inf, 0.0
        for turn in range(rounds):
            second_moves = (turn % 2 == 0) != swapped
            if second_moves:
                new = _answer(other_fields, second, first, risk, NO, crash[1], y, x, a,
                              reach_second, two, mixed)  # fmt: skip
                gain = two[b] - two[new]
            else:
                new = _answer(own_fields, first, second, risk, YES, crash[0], x, y, b,
                              reach_first, one, mixed)  # fmt: skip
                gain = one[a] - one[new]
            # What the other agent could gain is unknown in the first turn.
            if turn > 0 and max(gain, left) < least:
                best_a, best_b, least = a, b, max(gain, left)
            if gain <= limit:
                if turn > 0:
                    break
                left = gain
                continue
            left = 0.0
            if second_moves:
                b = new
            else:
                a = new
        a, b = choice[0, x, y], choice[1, x, y]
        if least > limit and (best_a != a or best_b != b):
            new = _answer(other_fields, second, first, risk, NO, crash[1], y, x, a,
                          reach_second, two, mixed)  # fmt: skip
            gain = two[b] - two[new]
            new = _answer(own_fields, first, second, risk, YES, crash[0], x, y, b, reach_first,
                          one, mixed)  # fmt: skip
            gain = max(gain, one[a] - one[new])
            if gain <= least + limit:
                best_a, best_b, least = a, b, gain
        choice[0, x, y], choice[1, x, y], regret[x, y] = best_a, best_b, least


@njit(cache=True, inline="always")
def _answer(field, own, other, risk, own_first, crash, x, y, b, reach, values, mixed):
    """Return the best action at ``x`` against action ``b`` at ``y``; write the costs of all."""
    if risk.empty and own.index.shape[2] == 1 and other.index.shape[2] == 1:
        row, chosen = other.index[y, b, 0], 0
        for action in range(values.size):
            values[action] = own.cost[x, action] + field[row, own.index[x, action, 0]]
            if values[action] < values[chosen]:
                chosen = action
    else:
        end = other.ends[y, b]
        near = is_near(risk, own_first, own.points[x], other.points[y], reach[x], end)
        chosen, _ = best_move(field, own, risk, own_first, crash, x, other.points[y],
                              other.index[y, b], other.weight[y, b], end, other.stays[y, b], near,
                              values, mixed)  # fmt: skip
    return chosen
