"""Compiled: means of one agent under a candidate plan, with its cost of time and effort.

A candidate follows the inputs of an earlier plan, moves differently in a window of steps, and then
goes on with those inputs or heads for its arrival region.
"""

from __future__ import annotations

from numba import njit

from ppg_env.env.projection import project_on_faces
from solvers.feedback.plan_risk import normal_below

GO, KEEP, TRACK = range(3)
"""After the window: head for the region, keep the earlier inputs; or track the game's plan."""

SHRUNK = 0.5
"""Aim at the nearest point of the arrival region, shrunk to this share."""

GONE = 1e-3
"""A plan ends when the agent has not arrived with a smaller probability."""


@njit(inline="always")
def write_law(gain, offset, target, x, delta, u):
    """Write the input gain x + offset + target delta."""
    for a in range(u.size):
        value = offset[a]
        for b in range(x.size):
            value += gain[a, b] * x[b] + target[a, b] * delta[b]
        u[a] = value


@njit(inline="always")
def head_for_region(g, i, v, k, x, delta, u, faster):
    """Write the input towards the region at full speed; return the number of its law.

    Laws from ``k`` on are tried, by the number of their steps.  The last law that asks for too
    much is approached as far as the set allows.
    """
    m, room, beyond = u.size, SHRUNK * g.tolerance, True
    gain, offset, target, last = g.law_gain[v], g.law_offset[v], g.law_target[v], g.laws[v] - 1
    normals = g.normals[g.first_face[v] : g.first_face[v + 1]]
    offsets = g.offsets[g.first_face[v] : g.first_face[v + 1]]
    for b in range(x.size):
        delta[b] = 0.0
        if b < g.goal_size[i]:
            delta[b] = min(max(x[b] - g.goal[i, b], -room), room)
    k = min(k, last)
    while True:
        write_law(gain[k], offset[k], target[k], x, delta, u)
        beyond = False
        for f in range(offsets.size):
            reach = -offsets[f]
            for a in range(m):
                reach += normals[f, a] * u[a]
            beyond = beyond or reach > 1e-9
        if not beyond or k >= last:
            break
        k += 1
    if k > 0 and not beyond:
        write_law(gain[k - 1], offset[k - 1], target[k - 1], x, delta, faster)
        share = 1.0
        for f in range(offsets.size):
            at, to = -offsets[f], -offsets[f]
            for a in range(m):
                at += normals[f, a] * u[a]
                to += normals[f, a] * faster[a]
            if to > 0.0:
                share = min(share, max(-at, 0.0) / max(to - at, 1e-300))
        for a in range(m):
            u[a] += share * (faster[a] - u[a])
    return k


@njit(inline="always")
def arrival_chance(g, i, t, x):
    """Return the probability that a state with mean ``x`` is in the arrival region."""
    chance = 1.0
    for b in range(g.goal_size[i]):
        off, deviation = x[b] - g.goal[i, b], g.deviations[i, t, b]
        if deviation > 0.0:
            above = normal_below(g.tail, (g.tolerance - off) / deviation)
            chance *= above - normal_below(g.tail, (-g.tolerance - off) / deviation)
        elif abs(off) > g.tolerance:
            chance = 0.0
        if chance <= 0.0:
            break
    return chance


@njit(cache=True)
def roll(
    g, i, clock, lam, kept, kept_steps, start, stop, move, size, tail, means, inputs, alive,
    scratch,
):  # fmt: skip
    """Write means (L + 1, n), inputs (L, m) and alive (L + 1,); return the expected cost.

    ``g`` is a :class:`solvers.feedback.plan_library.Motion`; ``means[0]`` is the present state.
    ``kept`` (L, m) are earlier inputs, of which ``kept_steps`` are used.  In steps from ``start``
    up to ``stop`` the input is moved by the share ``size`` towards the move with number ``move``.
    """
    L, n, m = inputs.shape[0], means.shape[1], inputs.shape[1]
    u, faster, delta = scratch[0, :m], scratch[1, :m], scratch[2, :n]
    alive[0], spent, k = 1.0, 0.0, 0
    for t in range(L):
        v = g.control_set[min(clock + t, g.control_set.shape[0] - 1), i]
        if tail == TRACK and clock + t < g.end[i]:
            for a in range(m):
                u[a] = g.nominal[i, clock + t, a]
                for b in range(n):
                    u[a] -= g.feedback[i, a, b] * (means[t, b] - g.means[i, clock + t, b])
            project_on_faces(g.normals, g.offsets, g.first_face[v], g.first_face[v + 1], u)
            k = 0
        elif t < kept_steps and (t < stop or tail == KEEP):
            for a in range(m):
                u[a] = kept[t, a]
        elif t >= stop or size < 1.0:
            k = max(head_for_region(g, i, v, k, means[t], delta, u, faster) - 1, 0)
        if start <= t < stop:
            for a in range(m):
                u[a] = (1.0 - size) * u[a] + size * g.moves[v, move, a]
            k = 0
        asked = 0.0
        for a in range(m):
            inputs[t, a] = u[a]
            asked += abs(u[a])
        for b in range(n):
            value = 0.0
            for q in range(n):
                value += g.A[i, b, q] * means[t, q]
            for q in range(m):
                value += g.B[i, b, q] * u[q]
            means[t + 1, b] = value
        spent += alive[t] * (lam + g.effort[i] * asked)
        alive[t + 1] = alive[t] * (1.0 - arrival_chance(g, i, t + 1, means[t + 1]))
        if alive[t + 1] < GONE:
            rest(t + 1, means, inputs, alive)
            break
    return spent + alive[L] * lam * L


@njit(cache=True)
def rest(t, means, inputs, alive):
    """Let the agent have arrived at time ``t``."""
    alive[t:] = 0.0
    inputs[t:] = 0.0
    for s in range(t + 1, alive.size):
        for b in range(means.shape[1]):
            means[s, b] = means[t, b]
