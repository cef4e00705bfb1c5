"""Compiled: which encounters are in traffic in a step, their margins and their collisions.

Bodies are the N agents, then the moving obstacles, in the order of the game.  An encounter (i, j)
has j = -1 for an obstacle at rest.  It is in traffic if both bodies are there and one of them
moves.

An event is an instant, or with ``swept`` the step that has just been made, in which agents that
arrive take part.  Arguments are as in :mod:`ppg_env.env.kernel`.
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
    axes, before, state, status, arrived, parked, clock, swept, stay, obstacle_times, lam, cap,
    pair, normals, offsets, units, safety_cost,
):  # fmt: skip
    """Charge the agents of encounters in traffic for margins below the cap.

    At instants this comes before the move; with ``swept`` after it, for the step.
    """
    C, N = status.shape
    last = units.shape[1] - 1
    presence = np.empty(state.shape[1] + 1, np.int64)
    frozen = np.empty((2 * stay, offsets.size))
    for c in range(C):
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
    own_bodies, axes, before, state, status, arrived, clock, swept, stay, obstacle_times, pair,
    own_faces, normals, depths, crashed, overlap,
):  # fmt: skip
    """Flag encounters in traffic that overlap, at the end of the step or during it.

    Each copy has ``own_faces`` faces of its own if the tuple ``own_bodies`` is not empty.
    """
    C, N = status.shape
    presence = np.empty(state.shape[1] + 1, np.int64)
    plain = not (swept or stay or obstacle_times.size)  # the paper's rules need no presence
    for c in range(C):
        for i in range(N):
            crashed[c, i] = False
        if not plain:
            mark_presence(c, clock[c] - swept, status, arrived, swept, stay, obstacle_times,
                          presence)  # fmt: skip
        for e in range(pair.shape[0]):
            i, j = pair[e, 0], pair[e, 1]
            overlap[c, e] = False
            if plain:
                if status[c, i] != TRAFFIC or (j >= 0 and status[c, j] != TRAFFIC):
                    continue
            elif presence[i] + presence[j] <= MOVING:
                continue
            shift = c * own_faces * len(own_bodies)
            first, last = pair[e, 2] + shift, pair[e, 3] + shift
            if swept:
                met = crossing(axes, before, state, c, i, j, normals, depths, first, last)
            else:
                met = inside(axes, state, c, i, j, normals, depths, first, last)
            if met:
                overlap[c, e] = True
                crashed[c, i] = True
                if 0 <= j < N:
                    crashed[c, j] = True
