"""Compiled: which encounters are in traffic in a step, their margins and their collisions.

Bodies are the N agents, then the moving obstacles, in the order of the game.  An encounter (i, j)
has j = -1 for an obstacle at rest.  It is in traffic if both bodies are there and one of them
moves.

An event is an instant, or with ``swept`` the step that has just been made, in which agents that
arrive take part.  Arguments are as in :mod:`ppg_env.env.kernel`; functions look at the copies from
``first_copy`` up to ``last_copy``.
"""

from __future__ import annotations

import numpy as np

from ppg_env.env.status import ARRIVED, TRAFFIC
from ppg_env.game.compiled_margins import best_face, best_step_face, crossing, inside
from ppg_env.support.compilation import njit

ABSENT, RESTING, MOVING = range(3)
"""Presence of a body: two bodies are in traffic if their sum exceeds ``MOVING``."""


@njit(inline="always")
def mark_presence(c, time, status, arrived, swept, stay, obstacle_times, presence):
    """Write the presence of every body of a copy in the event at ``time``.

    The last entry, which j = -1 reads, is that of obstacles at rest.
    """
    N = status.shape[1]
    for i in range(N):
        presence[i] = ABSENT
        if status[c, i] == TRAFFIC or (swept and arrived[c, i]):
            presence[i] = MOVING
        elif stay and status[c, i] == ARRIVED:
            presence[i] = RESTING
    for k in range(obstacle_times.shape[0]):
        rest, until = obstacle_times[k]
        presence[N + k] = RESTING if time >= rest else MOVING
        if time >= until:
            presence[N + k] = ABSENT
    presence[-1] = RESTING


@njit(cache=True)
def price_margins(
    first_copy, last_copy, axes, before, state, status, arrived, parked, clock, swept, stay,
    obstacle_times, lam, cap, pair, normals, offsets, units, safety_cost,
):  # fmt: skip
    """Charge the agents of encounters in traffic for margins below the cap.

    At instants this comes before the move; with ``swept`` after it, for the step.
    """
    N, last = status.shape[1], units.shape[1] - 1
    presence = np.empty(state.shape[1] + 1, np.int64)
    frozen = np.empty((2 * stay, offsets.size))
    for c in range(first_copy, last_copy):
        for i in range(N):
            safety_cost[c, i] = 0.0
        time = clock[c] - swept
        mark_presence(c, time, status, arrived, swept, stay, obstacle_times, presence)
        for e in range(pair.shape[0]):
            i, j = pair[e, 0], pair[e, 1]
            if presence[i] + presence[j] <= MOVING:
                continue
            first, end = pair[e, 2], pair[e, 3]
            table, row, following = units[0], min(time, last), min(time + 1, last)
            if stay:
                for k in range(1 + swept):
                    at = min(time + k, last)
                    own = min(at, parked[c, i])
                    other = min(at, parked[c, j]) if 0 <= j < N else at
                    for f in range(first, end):
                        frozen[k, f] = np.sqrt(units[1, own, f] + units[2, other, f])
                table, row, following = frozen, 0, 1
            if swept:
                best = best_step_face(axes, before, state, c, i, j, normals, offsets, first, end,
                                      table, row, following)  # fmt: skip
            else:
                best = best_face(axes, state, c, i, j, normals, offsets, first, end, table, row)
            missing = cap - min(best, cap)
            safety_cost[c, i] += (1.0 - lam[c, i]) * missing
            if 0 <= j < N:
                safety_cost[c, j] += (1.0 - lam[c, j]) * missing


@njit(cache=True)
def collide(
    first_copy, last_copy, axes, before, state, status, arrived, clock, swept, stay,
    obstacle_times, pair, own_faces, normals, depths, extents, crashed, overlap,
):  # fmt: skip
    """Flag encounters in traffic that overlap, at the end of the step or during it.

    Each copy has ``own_faces`` faces of its own, none if the copies share them.  Faces are
    looked at only where the boxes around the bodies overlap, whose sizes are ``extents``: that is
    decided without branches, and rare enough to be predicted.
    """
    N, C = status.shape[1], last_copy - first_copy
    pairs, obstacles = N * (N - 1) // 2, extents.shape[1] - N
    crashed[first_copy:last_copy] = False
    overlap[first_copy:last_copy] = False
    presence = np.empty((state.shape[1] + 1, C), np.int8)
    for c in range(C):
        time = clock[first_copy + c] - swept
        mark_presence(first_copy + c, time, status, arrived, swept, stay, obstacle_times,
                      presence[:, c])  # fmt: skip
    now, earlier = state[first_copy:last_copy], before[first_copy:last_copy]
    at_rest, near = np.zeros((C, 1, len(axes))), np.empty(C, np.bool_)
    for e in range(pair.shape[0]):
        i, j = pair[e, 0], pair[e, 1]
        body = j if e < pairs else N + (e - pairs) % obstacles
        own, other = now[:, i], now[:, j] if j >= 0 else at_rest[:, 0]
        for c in range(C):
            near[c] = presence[i, c] + presence[j, c] > MOVING
        for k in range(len(axes)):
            low = extents[0, body, k] - extents[1, i, k]
            high = extents[1, body, k] - extents[0, i, k]
            if swept:
                start, other_start = earlier[:, i], earlier[:, j] if j >= 0 else at_rest[:, 0]
                for c in range(C):
                    first, last = start[c, k] - other_start[c, k], own[c, k] - other[c, k]
                    beyond = ((first > high) & (last > high)) | ((first < low) & (last < low))
                    near[c] = near[c] & (not beyond)
            else:
                for c in range(C):
                    away = own[c, k] - other[c, k]
                    near[c] = near[c] & (not ((away > high) | (away < low)))
        for c in range(C):
            if not near[c]:
                continue
            shift = (first_copy + c) * own_faces
            begin, end = pair[e, 2] + shift, pair[e, 3] + shift
            if swept:
                met = crossing(axes, earlier, now, c, i, j, normals, depths, begin, end)
            else:
                met = inside(axes, now, c, i, j, normals, depths, begin, end)
            if met:
                overlap[first_copy + c, e] = True
                crashed[first_copy + c, i] = True
                if 0 <= j < N:
                    crashed[first_copy + c, j] = True
