"""Compiled: groups of equal states after a given player's moves, and sums over their stencils."""

from __future__ import annotations

import numpy as np

from ppg_env.support.compilation import njit


@njit(cache=True)
def group_ends(ends, group, kept):
    """Write the group (K,) of each of ``ends`` (K or 1, 2), -1 in none, and a member of each group.

    Return the sizes of the groups, whose members are equal.
    """
    sizes, count, last = np.zeros(kept.size, np.int64), 0, 0
    for x in range(group.size):
        at = x if ends.shape[0] > 1 else 0
        for k in range(count):
            g = last + k if last + k < count else last + k - count
            if ends[kept[g], 0] == ends[at, 0] and ends[kept[g], 1] == ends[at, 1]:
                break
        else:
            g = count if count < kept.size else -1
            if g >= 0:
                kept[g] = at
                count += 1
        group[x] = g
        if g >= 0:
            sizes[g] += 1
            last = g
    return sizes[:count]


@njit(cache=True)
def weighted(values, index, weight, count):
    """Return the interpolant of ``values`` over a stencil."""
    total = 0.0
    for t in range(count):
        total += weight[t] * values[index[t]]
    return total


@njit(cache=True)
def mix(field, index, weight, count, row):
    """Write the interpolant (K,) of ``field`` (L, K) over a stencil of its first axis."""
    row[:] = 0.0
    for t in range(count):
        source, scale = field[index[t]], np.float32(weight[t])
        for k in range(row.size):
            row[k] += scale * source[k]
