"""Compiled: collisions among many bodies, which are compared only if their boxes overlap.

The boxes around all bodies are sorted along the axis on which they are spread most and swept in
that order; source: Baraff, Dynamic Simulation of Non-Penetrating Rigid Bodies (1992).  The result
is that of :func:`ppg_env.env.encounters.collide`, which looks at every pair.
"""

from __future__ import annotations

import numpy as np

from ppg_env.env.encounters import ABSENT, MOVING, mark_presence
from ppg_env.game.compiled_margins import crossing, inside
from ppg_env.support.compilation import njit


@njit(cache=True)
def sweep(
    first_copy, last_copy, axes, before, state, status, arrived, clock, swept, stay,
    obstacle_times, pair, own_faces, normals, depths, extents, crashed, overlap,
):  # fmt: skip
    """Flag encounters in traffic that overlap; arguments are those of ``collide``.

    Encounters are those of all pairs of agents, then of each agent with each obstacle.
    """
    N = status.shape[1]
    M, pairs = extents.shape[1], N * (N - 1) // 2
    presence = np.empty(state.shape[1] + 1, np.int64)
    place, present = np.arange(M), np.empty(M, np.int64)
    for b in range(N, M):  # the body of an obstacle, -1 at rest
        place[b] = pair[pairs + b - N, 1]
    low, high = np.empty((M, len(axes))), np.empty((M, len(axes)))
    for c in range(first_copy, last_copy):
        crashed[c, :] = False
        overlap[c, :] = False
        mark_presence(c, clock[c] - swept, status, arrived, swept, stay, obstacle_times, presence)
        count = 0
        for b in range(M):
            if presence[place[b]] != ABSENT:
                present[count] = b
                count += 1
        _bound(axes, before, state, c, swept, place, present[:count], extents, low, high)
        axis = _widest(axes, present[:count], low, high)
        order = present[:count][np.argsort(low[present[:count], axis])]
        for first in range(count):
            a = order[first]
            for second in range(first + 1, count):
                b = order[second]
                if low[b, axis] > high[a, axis]:
                    break
                i, j = min(a, b), max(a, b)
                if i >= N or presence[place[i]] + presence[place[j]] <= MOVING:
                    continue
                apart = False
                for k in range(len(axes)):
                    apart = apart or low[a, k] > high[b, k] or low[b, k] > high[a, k]
                if apart:
                    continue
                e = i * (2 * N - i - 1) // 2 + j - i - 1
                if j >= N:
                    e = pairs + i * (M - N) + j - N
                start, end = pair[e, 2] + c * own_faces, pair[e, 3] + c * own_faces
                if swept:
                    met = crossing(axes, before, state, c, i, place[j], normals, depths, start, end)
                else:
                    met = inside(axes, state, c, i, place[j], normals, depths, start, end)
                if met:
                    overlap[c, e] = True
                    crashed[c, i] = True
                    if j < N:
                        crashed[c, j] = True


@njit(inline="always")
def _bound(axes, before, state, c, swept, place, present, extents, low, high):
    """Write the boxes around the present bodies, during the step if ``swept``.

    Positions that overflowed overlap with everything, as they do face by face.
    """
    for b in present:
        for k in range(len(axes)):
            here = state[c, place[b], k] if place[b] >= 0 else 0.0
            there = before[c, place[b], k] if swept and place[b] >= 0 else here
            low[b, k] = min(here, there) + extents[0, b, k]
            high[b, k] = max(here, there) + extents[1, b, k]
            if not np.isfinite(here + there):
                low[b, :] = -np.inf
                high[b, :] = np.inf
                break


@njit(inline="always")
def _widest(axes, present, low, high):
    """Return the axis on which the boxes are spread most, for the size of the largest."""
    best, axis = -1.0, 0
    for k in range(len(axes)):
        least, most, size = np.inf, -np.inf, 0.0
        for b in present:
            if np.isfinite(low[b, k]):
                least, most = min(least, low[b, k]), max(most, low[b, k])
                size = max(size, high[b, k] - low[b, k])
        if most - least > best * size:
            best, axis = (most - least) / max(size, 1e-300), k
    return axis
