"""Compiled: means of one agent under a candidate plan, with its cost of time and effort.

A candidate follows the inputs of an earlier plan, moves differently in a window of steps, and then
goes on with those inputs or heads for its arrival region.
"""

from __future__ import annotations

from ppg_env.env.projection import project_on_faces
from ppg_env.support.compilation import njit
from solvers.feedback.replanning.normal_tail import normal_below

GO, KEEP, TRACK = range(3)
"""After the window: head for the region, keep the earlier inputs; or track the game's plan."""

SHRUNK = 0.5
"""Aim at the nearest point of the arrival region, shrunk to this share."""

GONE = 1e-3
"""A plan ends when the agent has not arrived with a smaller probability."""


@njit(inline="always")
def write_law(gain, offset, target, v, k, means, t, delta, u):
    """Write the input of law k of set v: gain x + offset + target delta."""
    for a in range(u.size):
        value = offset[v, k, a]
        for b in range(delta.size):
            value += gain[v, k, a, b] * means[t, b] + target[v, k, a, b] * delta[b]
        u[a] = value


@njit(inline="always")
def admissible(normals, offsets, first, last, u):
    """Return whether an input is in its set."""
    inside = True
    for f in range(first, last):
        reach = -offsets[f]
        for a in range(u.size):
            reach += normals[f, a] * u[a]
        inside = inside and reach <= 1e-9
    return inside


@njit(inline="always")
def speed_up(normals, offsets, first, last, u, faster):
    """Move an admissible input towards ``faster`` as far as the set allows."""
    share = 1.0
    for f in range(first, last):
        at, to = -offsets[f], -offsets[f]
        for a in range(u.size):
            at += normals[f, a] * u[a]
            to += normals[f, a] * faster[a]
        if to > 0.0:
            share = min(share, max(-at, 0.0) / max(to - at, 1e-300))
    for a in range(u.size):
        u[a] += share * (faster[a] - u[a])


@njit(inline="always")
def arrival_chance(goal, deviations, tolerance, tail, i, means, t, goal_size):
    """Return the probability that the state at time t is in the arrival region."""
    chance = 1.0
    for b in range(goal_size):
        off, deviation = means[t, b] - goal[i, b], deviations[i, t, b]
        if deviation > 0.0:
            above = normal_below(tail, (tolerance[i, b] - off) / deviation)
            chance *= above - normal_below(tail, (-tolerance[i, b] - off) / deviation)
        elif abs(off) > tolerance[i, b]:
            chance = 0.0
        if chance <= 0.0:
            break
    return chance


@njit(inline="always")
def leads_out(walls, limits, first, last, means, t, clock):
    """Return whether the step that ends at time t leads further out of the workspace."""
    out, row = False, min(clock + t, limits.shape[0] - 1)
    for w in range(first, last):
        before, after = 0.0, 0.0
        for b in range(means.shape[1]):
            before += walls[w, b] * means[t - 1, b]
            after += walls[w, b] * means[t, b]
        out = out or (after > limits[row, w] + 1e-6 and after > before)
    return out


@njit(cache=True)
def roll(
    g, i, clock, lam, kept, kept_steps, start, stop, move, size, after, means, inputs, alive,
    scratch,
):  # fmt: skip
    """Write means (L + 1, n), inputs (L, m) and alive (L + 1,); return the expected cost.

    ``g`` is a :class:`solvers.feedback.replanning.motion.Motion`; ``means[0]`` is the present
    state.  ``kept`` (L, m) are earlier inputs, of which ``kept_steps`` are used.  In steps from
    ``start`` up to ``stop`` the input is moved by the share ``size`` towards the move ``move``.
    On the way to the region the law is the fastest that is admissible, and then the input is moved
    towards the next faster one as far as the set allows: this is full speed.
    """
    L, n, m = inputs.shape[0], means.shape[1], inputs.shape[1]
    u, faster, delta = scratch[0, :m], scratch[1, :m], scratch[2, :n]
    # Locals: each use of a field of a tuple counts references.
    A, B, goal, effort, end = g.A, g.B, g.goal, g.effort[i], g.end[i]
    normals, offsets, first_face, moves = g.normals, g.offsets, g.first_face, g.moves
    gain, offset, target, laws = g.law_gain, g.law_offset, g.law_target, g.laws
    control_set, deviations, table, goal_size = g.control_set, g.deviations, g.tail, g.goal_size[i]
    last_row, tolerance = control_set.shape[0] - 1, g.tolerance
    alive[0], spent, k = 1.0, 0.0, 0
    for b in range(n):
        delta[b] = 0.0
    for t in range(L):
        v = control_set[min(clock + t, last_row), i]
        first, last = first_face[v], first_face[v + 1]
        if after == TRACK and clock + t < end:
            for a in range(m):
                u[a] = g.nominal[i, clock + t, a]
                for b in range(n):
                    u[a] -= g.feedback[i, a, b] * (means[t, b] - g.means[i, clock + t, b])
            project_on_faces(normals, offsets, first, last, u)
        elif t < kept_steps and (t < stop or after == KEEP):
            for a in range(m):
                u[a] = kept[t, a]
        elif t >= stop or size < 1.0:
            for b in range(goal_size):
                room = SHRUNK * tolerance[i, b]
                delta[b] = min(max(means[t, b] - goal[i, b], -room), room)
            k = min(k, laws[v] - 1)
            write_law(gain, offset, target, v, k, means, t, delta, u)
            inside = admissible(normals, offsets, first, last, u)
            while not inside and k < laws[v] - 1:
                k += 1
                write_law(gain, offset, target, v, k, means, t, delta, u)
                inside = admissible(normals, offsets, first, last, u)
            if not inside:
                project_on_faces(normals, offsets, first, last, u)
            elif k > 0:
                write_law(gain, offset, target, v, k - 1, means, t, delta, faster)
                speed_up(normals, offsets, first, last, u, faster)
            k = max(k - 1, 0)
        if start <= t < stop:
            for a in range(m):
                u[a] = (1.0 - size) * u[a] + size * moves[v, move, a]
            k = 0
        asked = 0.0
        for a in range(m):
            inputs[t, a] = u[a]
            asked += abs(u[a])
        for b in range(n):
            value = 0.0
            for q in range(n):
                value += A[i, b, q] * means[t, q]
            for q in range(m):
                value += B[i, b, q] * u[q]
            means[t + 1, b] = value
        spent += alive[t] * (lam + effort * asked)
        if g.first_wall[i + 1] > g.first_wall[i]:
            bounds = g.first_wall[i], g.first_wall[i + 1]
            if leads_out(g.walls, g.limits, bounds[0], bounds[1], means, t + 1, clock):
                spent += alive[t] * g.outside_cost
        chance = arrival_chance(goal, deviations, tolerance, table, i, means, t + 1, goal_size)
        alive[t + 1] = alive[t] * (1.0 - chance)
        if alive[t + 1] < GONE:
            rest(t + 1, means, inputs, alive)
            break
    return spent + alive[L] * lam * L


@njit(cache=True)
def rest(t, means, inputs, alive):
    """Let the agent have arrived at time ``t``."""
    alive[t] = 0.0
    for s in range(t, alive.size - 1):
        alive[s + 1] = 0.0
        for a in range(inputs.shape[1]):
            inputs[s, a] = 0.0
        for b in range(means.shape[1]):
            means[s + 1, b] = means[t, b]
