"""Compiled: means of one agent under a candidate plan, with its cost of time and effort.

A candidate follows the inputs of an earlier plan, moves differently in a window of steps, and then
goes on with those inputs or heads for its arrival region.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ppg_env.env.arrays import BOX, POLYGON
from ppg_env.env.projection import project_on_faces, project_on_polygon
from solvers.feedback.plan_risk import normal_below

GO, KEEP, TRACK = range(3)
"""After the window: head for the region, keep the earlier inputs; or track the game's plan."""

SHRUNK = 0.5
"""Aim at the nearest point of the arrival region, shrunk to this share."""

GONE = 1e-3
"""A plan ends when the agent has not arrived with a smaller probability."""


@njit(cache=True)
def fraction_inside(normals, offsets, first, last, inner, outer, m):
    """Return the largest share of the way from ``inner`` to ``outer`` that is admissible."""
    share = 1.0
    for f in range(first, last):
        at, to = -offsets[f], -offsets[f]
        for k in range(m):
            at += normals[f, k] * inner[k]
            to += normals[f, k] * outer[k]
        if to > 0.0:
            share = min(share, max(-at, 0.0) / max(to - at, 1e-300))
    return share


@njit(cache=True)
def law_input(library, v, k, x, delta, u):
    """Write the first input of the law with number ``k`` of set ``v``."""
    gain, offset, target = library.law_gain, library.law_offset, library.law_target
    for a in range(u.size):
        value = offset[v, k, a]
        for b in range(x.size):
            value += gain[v, k, a, b] * x[b] + target[v, k, a, b] * delta[b]
        u[a] = value


@njit(cache=True)
def head_for_region(g, library, i, v, k, x, delta, u, faster):
    """Write the input towards the region at full speed; return the number of its law.

    Laws from ``k`` on are tried, by the number of their steps.  The last law that asks for too
    much is approached as far as the set allows.
    """
    first, last, m = g.first_row[1, v], g.first_row[1, v + 1], u.size
    for b in range(x.size):
        delta[b] = 0.0
        if b < g.agent_codes[0, i]:
            room = SHRUNK * g.tolerance
            delta[b] = min(max(x[b] - g.goal[i, b], -room), room)
    count = library.laws[v]
    k = min(max(k, 0), count - 1)
    while True:
        law_input(library, v, k, x, delta, u)
        excess = -1.0
        for f in range(first, last):
            reach = -g.input_offsets[f]
            for a in range(m):
                reach += g.input_normals[f, a] * u[a]
            excess = max(excess, reach)
        if excess <= 1e-9 or k == count - 1:
            break
        k += 1
    if k > 0:
        law_input(library, v, k - 1, x, delta, faster)
        share = fraction_inside(g.input_normals, g.input_offsets, first, last, u, faster, m)
        for a in range(m):
            u[a] += share * (faster[a] - u[a])
    return k


@njit(cache=True)
def project(g, v, u):
    """Replace ``u`` by the nearest admissible input."""
    kind = g.projection[v]
    if kind == BOX:
        for a in range(u.size):
            u[a] = min(max(u[a], g.limits[0, v, a]), g.limits[1, v, a])
    elif kind == POLYGON:
        project_on_polygon(g.edges, g.first_row[0, v], g.first_row[0, v + 1], u)
    else:
        project_on_faces(
            g.input_normals, g.input_offsets, g.first_row[1, v], g.first_row[1, v + 1], u
        )


@njit(cache=True)
def arrival_chance(g, library, i, t, x):
    """Return the probability that a state with mean ``x`` is in the arrival region."""
    chance = 1.0
    for b in range(g.agent_codes[0, i]):
        off, deviation = x[b] - g.goal[i, b], library.arrival_deviations[i, t, b]
        if deviation > 0.0:
            above = normal_below(library.tail, (g.tolerance - off) / deviation)
            chance *= above - normal_below(library.tail, (-g.tolerance - off) / deviation)
        elif abs(off) > g.tolerance:
            chance = 0.0
        if chance <= 0.0:
            return 0.0
    return chance


@njit(cache=True)
def roll(
    g, library, i, clock, lam, kept, kept_steps, start, stop, move, size, tail, means, inputs,
    alive, scratch,
):  # fmt: skip
    """Write means (L + 1, n), inputs (L, m) and alive (L + 1,); return the expected cost.

    ``means[0]`` is the present state.  ``kept`` (L, m) are earlier inputs, of which
    ``kept_steps`` are used.  In steps from ``start`` up to ``stop`` the input is moved by the
    share ``size`` towards the move with number ``move``.
    """
    L, n, m = inputs.shape[0], means.shape[1], inputs.shape[1]
    u, faster, delta = scratch[0, :m], scratch[1, :m], scratch[2, :n]
    alive[0], spent, k, heading = 1.0, 0.0, 0, False
    for t in range(L):
        row = min(clock + t, g.control_set.shape[0] - 1)
        v, x = g.control_set[row, i], means[t]
        tracking = tail == TRACK and clock + t < library.end[i]
        if tracking:
            for a in range(m):
                u[a] = library.nominal[i, clock + t, a]
                for b in range(n):
                    u[a] -= library.feedback[i, a, b] * (x[b] - library.means[i, clock + t, b])
            project(g, v, u)
        elif t < kept_steps and (t < stop or tail == KEEP):
            for a in range(m):
                u[a] = kept[t, a]
        elif not (start <= t < stop and size == 1.0):
            k = head_for_region(g, library, i, v, k - 1 if heading else 0, x, delta, u, faster)
            heading = True
        if start <= t < stop:
            for a in range(m):
                u[a] = (1.0 - size) * u[a] + size * library.moves[v, move, a]
            heading = False
        asked = 0.0
        for a in range(m):
            inputs[t, a] = u[a]
            asked += abs(u[a])
        for b in range(n):
            value = 0.0
            for q in range(n):
                value += g.A[i, b, q] * x[q]
            for q in range(m):
                value += g.B[i, b, q] * u[q]
            means[t + 1, b] = value
        spent += alive[t] * (lam + g.effort[i] * asked)
        alive[t + 1] = alive[t] * (1.0 - arrival_chance(g, library, i, t + 1, means[t + 1]))
        if alive[t + 1] < GONE:
            for s in range(t + 1, L):
                alive[s + 1] = 0.0
                for a in range(m):
                    inputs[s, a] = 0.0
                for b in range(n):
                    means[s + 1, b] = means[t + 1, b]
            alive[t + 1] = 0.0
            break
    return spent + alive[L] * lam * L
