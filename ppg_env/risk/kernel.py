"""Compiled loops of the simulation of plans: draw deviations, find overlaps, measure margins.

Deviations are (T+1, S, n, B): times, processes, components, episodes.  Episodes come last, unlike
elsewhere, so that the innermost loops run over them and use vector instructions.  All functions
release the interpreter lock, so that blocks run in parallel threads.
"""

from __future__ import annotations

import numpy as np

from ppg_env.env.status import ARRIVED, TRAFFIC
from ppg_env.game.compiled_margins import best_face, clip, within
from ppg_env.support.compilation import njit


@njit(cache=True, nogil=True)
def draw(random, loops, roots, starts, random_start, out):
    """Fill ``out`` (T+1, S, n, B): e_0 = start z, e_{t+1} = F e_t + root z, z standard normal."""
    T, S, n, B = out.shape
    fresh = np.empty((n, B))
    for t in range(T):
        if t == 0 and not random_start:
            out[0] = 0.0
            continue
        for s in range(S):
            for q in range(n):
                for b in range(B):
                    fresh[q, b] = random.standard_normal()
            root = starts[s] if t == 0 else roots[s]
            for k in range(n):
                row = out[t, s, k]
                row[:] = 0.0
                for q in range(n):
                    if root[k, q] != 0.0:
                        _add(row, root[k, q], fresh[q])
                    if t > 0 and loops[s, k, q] != 0.0:
                        _add(row, loops[s, k, q], out[t - 1, s, q])


@njit(cache=True, nogil=True)
def overlaps(
    errors, episodes, parties, until, normals, depths, first_face, nominal, swept,
    times, first_times, first_any, met,
):  # fmt: skip
    """Count the overlaps of a block's first ``episodes``.

    ``nominal`` (E, T+1, d) mean displacements; encounter e is in traffic before ``until[e]``.
    At instants, or with ``swept`` during the steps that begin in traffic (time t: the step that
    ends at t).  Adds to ``times`` and ``first_times`` (E, T+1) the episodes in which e overlaps
    at t, and does so for the first time; to ``first_any`` (T+1,) those whose first overlap is at
    t; sets ``met`` (E, B) where e overlapped at all.
    """
    E, B = len(parties), errors.shape[3]
    most = 0
    for e in range(E):
        most = max(most, first_face[e + 1] - first_face[e])
    crashed = np.zeros(B, np.bool_)
    beyond = np.empty((2, E, most, B))  # distance beyond each face, now and one step ago
    inside, rooms = np.empty(B, np.bool_), np.empty(most)
    for t in range(errors.shape[0]):
        for e in range(E):
            if t >= until[e] + swept:
                continue
            F = first_face[e + 1] - first_face[e]
            faces = normals[first_face[e] : first_face[e + 1]]
            for f in range(F):
                rooms[f] = depths[first_face[e] + f]
                for k in range(faces.shape[1]):
                    rooms[f] -= faces[f, k] * nominal[e, t, k]
            now, before = beyond[t % 2, e, :F], beyond[(t + 1) % 2, e, :F]
            clear(errors, t, parties[e, 0], parties[e, 1], faces, rooms, now)
            if not swept:
                _contain(now, inside)
            elif t > 0:
                _enter(before, now, inside)
            else:
                continue
            for b in range(episodes):
                if not inside[b]:
                    continue
                times[e, t] += 1
                if not met[e, b]:
                    met[e, b] = True
                    first_times[e, t] += 1
                if not crashed[b]:
                    crashed[b] = True
                    first_any[t] += 1


@njit(cache=True, nogil=True)
def clear(errors, t, first, second, normals, rooms, out):
    """Write the distance beyond each face: ``out`` (F, B) = normal . (e_a - e_b)(t) - room."""
    for f in range(len(normals)):
        row = out[f]
        row[:] = -rooms[f]
        for k in range(normals.shape[1]):
            if normals[f, k] != 0.0:
                _add(row, normals[f, k], errors[t, first, k])
                if second >= 0:
                    _add(row, -normals[f, k], errors[t, second, k])


@njit(cache=True, nogil=True)
def _contain(beyond, inside):
    """Flag the episodes in which a point is beyond no face."""
    inside[:] = True
    for f in range(len(beyond)):
        for b in range(inside.size):
            inside[b] &= within(beyond[f, b], 0.0)


@njit(cache=True, nogil=True)
def _enter(before, now, inside):
    """Flag segments between two points that meet the polytope."""
    for b in range(inside.size):
        start, end = 0.0, 1.0
        for f in range(len(now)):
            start, end = clip(before[f, b], now[f, b], start, end)
            if start > end:
                break
        inside[b] = start <= end


@njit(cache=True, nogil=True)
def _add(row, factor, other):
    for b in range(row.size):
        row[b] += factor * other[b]


@njit(cache=True, nogil=True)
def condition(errors, which, wanted, parties, times, normals, deviations, responses):
    """Shift each episode so that its component ``which`` takes the ``wanted`` value.

    Component c is the standard normal y = normal . (e_a - e_b)(t) / deviation; ``responses``
    (C, T+1, 2, n) are the covariances of e_a and e_b with it, at all times.  Adding
    (wanted - y) times those to a sample gives one conditioned on y = wanted.
    """
    for b in range(which.size):
        c = which[b]
        first, second, value = parties[c, 0], parties[c, 1], 0.0
        for k in range(normals.shape[1]):
            difference = errors[times[c], first, k, b]
            if second >= 0:
                difference -= errors[times[c], second, k, b]
            value += normals[c, k] * difference
        shift = wanted[b] - value / deviations[c]
        for t in range(errors.shape[0]):
            for k in range(errors.shape[2]):
                errors[t, first, k, b] += shift * responses[c, t, 0, k]
                if second >= 0:
                    errors[t, second, k, b] += shift * responses[c, t, 1, k]


@njit(cache=True, nogil=True)
def densities(errors, parties, times, normals, offsets, rates, out):
    """Add to ``out`` (B,) the rates of the half-spaces that contain the episode."""
    beyond = np.empty((1, errors.shape[3]))
    for c in range(times.size):
        clear(errors, times[c], parties[c, 0], parties[c, 1], normals[c : c + 1],
              offsets[c : c + 1], beyond)  # fmt: skip
        for b in range(out.size):
            out[b] += rates[c] * (beyond[0, b] <= 0.0)


@njit(cache=True, nogil=True)
def approach(axes, state, status, clock, stay, pair, normals, offsets, units, closest):
    """Lower ``closest`` (C,) to the smallest margin of the bodies that can collide now.

    These are, as in :mod:`ppg_env.env.kernel`, pairs of one agent in traffic and another in traffic
    or parked, and agents in traffic with obstacles.
    """
    for c in range(closest.size):
        row = min(clock[c], units.shape[0] - 1)
        for e in range(pair.shape[0]):
            i, j = pair[e, 0], pair[e, 1]
            agent = 0 <= j < status.shape[1]
            first, second = status[c, i], status[c, j] if agent else TRAFFIC
            parked = stay and agent and first + second == ARRIVED  # one parked, one in traffic
            if not parked and (first != TRAFFIC or second != TRAFFIC):
                continue
            best = best_face(axes, state, c, i, j, normals, offsets, pair[e, 2], pair[e, 3], units,
                             row)  # fmt: skip
            closest[c] = min(closest[c], best)
