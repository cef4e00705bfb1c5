"""Compiled: pure equilibria of the game between two agents at every joint grid state of a stage.

Arguments are as in :mod:`solvers.feedback.grid.stage_kernels`.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from ppg_env.support.compilation import njit
from solvers.feedback.grid.stage_kernels import best_move, exposed, is_near, overlap

EQUILIBRIUM, ENUMERATED, NONE = range(3)
"""How the actions of a state were found: by best responses, by enumeration, or as the pair of
least regret because no pair is an equilibrium."""

SLACK = 1e-4
"""A deviation that gains no more than this counts as none; without it, rounding makes actions of
equal cost alternate."""


@njit(cache=True, parallel=True)
def stage_equilibria(own_fields, other_fields, first, second, risk, crash, reach_first,
                     reach_second, swapped, rounds, enumerate_pairs,
                     choice, how):  # fmt: skip
    """Improve ``choice`` (2, K1, K2) to an equilibrium of each stage game; write how.

    ``own_fields`` (K2, K1) is the first agent's field, ``other_fields`` (K1, K2) the second's.
    """
    for x in prange(choice.shape[1]):
        values = (
            np.empty(first.cost.shape[1], np.float32),
            np.empty(second.cost.shape[1], np.float32),
        )
        for y in range(choice.shape[2]):
            a, b = choice[0, x, y], choice[1, x, y]
            settled = 0
            for turn in range(rounds):
                if (turn % 2 == 0) != swapped:
                    near = is_near(risk, False, second.points[y], first.points[x],
                                   reach_second[y], first.ends[x, a])  # fmt: skip
                    new, least = best_move(other_fields, second, risk, False, crash[1], y,
                                       first.points[x], first.index[x, a], first.weight[x, a],
                                       first.ends[x, a], first.stays[x, a], near,
                                       values[1])  # fmt: skip
                    stays = values[1][b] <= least + SLACK
                    settled = settled + 1 if stays and turn > 0 else 0
                    b = b if stays else new
                else:
                    near = is_near(risk, True, first.points[x], second.points[y],
                                   reach_first[x], second.ends[y, b])  # fmt: skip
                    new, least = best_move(own_fields, first, risk, True, crash[0], x,
                                           second.points[y], second.index[y, b],
                                           second.weight[y, b], second.ends[y, b],
                                           second.stays[y, b], near, values[0])  # fmt: skip
                    stays = values[0][a] <= least + SLACK
                    settled = settled + 1 if stays and turn > 0 else 0
                    a = a if stays else new
                if settled >= 1:
                    break
            how[x, y] = EQUILIBRIUM
            if settled == 0 and enumerate_pairs:
                a, b, how[x, y] = _enumerate(own_fields, other_fields, first, second, risk, crash,
                                             x, y)  # fmt: skip
            choice[0, x, y], choice[1, x, y] = a, b


@njit(cache=True)
def _enumerate(own_fields, other_fields, first, second, risk, crash, x, y):
    """Return the pair of actions of least regret, summed over agents, and how it was found."""
    rows, columns = first.index.shape[1], second.index.shape[1]
    one, two = np.empty((rows, columns)), np.empty((rows, columns))
    for a in range(rows):
        for b in range(columns):
            one[a, b] = _pair(own_fields, first, second, risk, True, crash[0], x, a, y, b)
            two[a, b] = _pair(other_fields, second, first, risk, False, crash[1], y, b, x, a)
    least, chosen_a, chosen_b = np.inf, 0, 0
    floor_one, floor_two = np.empty(columns), np.empty(rows)
    for b in range(columns):
        floor_one[b] = one[:, b].min()
    for a in range(rows):
        floor_two[a] = two[a].min()
    for a in range(rows):
        for b in range(columns):
            regret = max(one[a, b] - floor_one[b], two[a, b] - floor_two[a])
            if regret < least - SLACK:
                least, chosen_a, chosen_b = regret, a, b
    return chosen_a, chosen_b, ENUMERATED if least <= SLACK else NONE


@njit(cache=True)
def _pair(field, own, other, risk, own_first, crash, x, a, y, b):
    """Return the cost of one agent for a pair of actions."""
    value = 0.0
    for t in range(other.index.shape[2]):
        row, part = other.index[y, b, t], 0.0
        for s in range(own.index.shape[2]):
            part += own.weight[x, a, s] * field[row, own.index[x, a, s]]
        value += other.weight[y, b, t] * part
    p = overlap(risk, own_first, own.points[x], other.points[y], own.ends[x, a], other.ends[y, b])
    p *= exposed(risk, own.stays[x, a], other.stays[y, b])
    value += p * (crash - value if risk.removes else crash)
    return value + own.cost[x, a]
