"""The compiled inner loop: one step of many copies of a game.

The single environment and the batched simulator both run this; noise comes in as an argument, so
that they can be compared draw by draw.  Each function is one phase of the step and runs over all
copies C and agents N; they take plain arrays, since handing a tuple of forty arrays from one
compiled function to another costs more than the work inside.  Numba compiles at first use and
keeps the machine code on disk.

Dimensions come as tuples of that length (``state_axes`` of n zeros, and so on): the length of a
tuple is part of its type, so the compiler knows it and unrolls the loops over components.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ppg_env.env.arrays import BOX, FACES, POLYGON, Tables
from ppg_env.env.status import ARRIVED, CRASHED, TRAFFIC
from ppg_env.game.compiled_margins import best_face, inside

SWEEPS = 200
"""Most sweeps of Hildreth's projection; it stops when a sweep changes less than SETTLED."""

SETTLED = 1e-12


@njit(cache=True)
def step(
    g: Tables, state, status, alive, clock, lam, action, noise, restarting, start_noise,
    reward, time_cost, safety_cost, arrived, crashed, overlap, terminated, truncated, acting, over,
    observation, final_observation,
):  # fmt: skip
    """One step of every copy; with ``restarting``, copies whose episode is over begin anew.

    ``terminated`` and ``alive`` follow the life-cycle of the rules; agents that a time limit cuts
    off are ``truncated`` and no longer alive; ``over`` marks copies whose episode has ended.
    """
    acting[:] = alive
    if g.margin_reward:
        _price_margins(g.axes, status, clock, state, lam, g.margin_cap, g.pair,
                       g.normals, g.offsets, g.first_face, g.units, safety_cost)  # fmt: skip
    _move(g.state_axes, g.input_axes, state, status, clock, action, noise, g.A, g.B, g.root,
          g.separable, g.control_set, g.projection, g.low, g.high, g.edges, g.first_edge,
          g.input_normals, g.input_offsets, g.first_input, g.goal, g.goal_size, g.tolerance,
          g.schedule, g.scheduled, lam, arrived, time_cost)  # fmt: skip
    _collide(g.axes, state, status, g.pair, g.normals, g.depths, g.first_face, g.stay, crashed,
             overlap)  # fmt: skip
    _settle(status, alive, clock, crashed, lam, g.crash_cost, g.margin_reward, g.remove_crashed,
            g.stay, g.social, g.max_cycles, time_cost, safety_cost, reward, terminated, truncated,
            over)  # fmt: skip
    _observe(g.state_axes, g.axes, over, False, state, status, clock, g.goal, g.goal_size,
             g.centre, g.scale, g.max_cycles, g.stay, observation)  # fmt: skip
    final = final_observation if restarting else observation
    _observe(g.state_axes, g.axes, over, True, state, status, clock, g.goal, g.goal_size,
             g.centre, g.scale, g.max_cycles, g.stay, final)  # fmt: skip
    if restarting:
        begin(g, over, state, status, alive, clock, start_noise, observation)


@njit(cache=True)
def begin(g: Tables, chosen, state, status, alive, clock, noise, observation):
    """Put the ``chosen`` copies at the start; ``noise`` (C, N, n) is read if starts are random."""
    _restart(g.state_axes, chosen, state, status, alive, clock, noise, g.start, g.start_root,
             g.random_start, g.goal, g.goal_size, g.tolerance, g.schedule, g.scheduled)  # fmt: skip
    _observe(g.state_axes, g.axes, chosen, True, state, status, clock, g.goal, g.goal_size,
             g.centre, g.scale, g.max_cycles, g.stay, observation)  # fmt: skip


@njit(cache=True)
def _restart(
    state_axes, chosen, state, status, alive, clock, noise, start, root, random,
    goal, goal_size, tolerance, schedule, scheduled,
):  # fmt: skip
    """Everybody at its start; who is at its goal there has arrived at time 0."""
    C, N = status.shape
    n = len(state_axes)
    for c in range(C):
        if not chosen[c]:
            continue
        clock[c] = 0
        for i in range(N):
            status[c, i] = TRAFFIC
            alive[c, i] = True
            for k in range(n):
                value = start[i, k]
                if random:
                    for q in range(n):
                        value += root[i, k, q] * noise[c, i, q]
                state[c, i, k] = value
            there = schedule[i] <= 0
            if not scheduled:
                there = True
                for k in range(goal_size[i]):
                    there = there and abs(state[c, i, k] - goal[i, k]) <= tolerance
            if there:
                status[c, i] = ARRIVED


@njit(cache=True)
def _observe(
    state_axes, axes, marks, marked, state, status, clock, goal, goal_size, centre, scale,
    max_cycles, stay, out,
):  # fmt: skip
    """Write the observations of the copies whose mark is ``marked`` to ``out`` (C, N, width).

    Agent i sees, lengths divided by ``scale``: its state minus the goal (n), its position from
    the centre (d), 1 if it is in traffic, the share of ``max_cycles`` gone; then for each other
    agent 1 if its body is there, and if so its position relative to i (d) and the rest of its
    state (n - d).
    """
    C, N = status.shape
    n, d = len(state_axes), len(axes)
    inverse, share = 1.0 / scale, 1.0 / max_cycles
    for c in range(C):
        if marks[c] != marked:
            continue
        for i in range(N):
            w = 0
            for k in range(n):
                target = goal[i, k] if k < goal_size[i] else 0.0
                out[c, i, w] = (state[c, i, k] - target) * inverse
                w += 1
            for k in range(d):
                out[c, i, w] = (state[c, i, k] - centre[k]) * inverse
                w += 1
            out[c, i, w] = 1.0 if status[c, i] == TRAFFIC else 0.0
            out[c, i, w + 1] = clock[c] * share
            w += 2
            for j in range(N):
                if j == i:
                    continue
                there = status[c, j] == TRAFFIC or (stay and status[c, j] == ARRIVED)
                out[c, i, w] = 1.0 if there else 0.0
                w += 1
                for k in range(n):
                    value = 0.0
                    if there:
                        value = state[c, j, k] - (state[c, i, k] if k < d else 0.0)
                    out[c, i, w] = value * inverse
                    w += 1


@njit(cache=True)
def _price_margins(
    axes, status, clock, state, lam, cap, pair, normals, offsets, first_face, units,
    safety_cost,
):  # fmt: skip
    """What the margins are short of the cap, for those in traffic, before they move."""
    C, N = status.shape
    for c in range(C):
        for i in range(N):
            safety_cost[c, i] = 0.0
        row = min(clock[c], units.shape[0] - 1)
        for e in range(pair.shape[0]):
            i, j = pair[e, 0], pair[e, 1]
            if status[c, i] != TRAFFIC or (j >= 0 and status[c, j] != TRAFFIC):
                continue
            best = best_face(axes, state, c, i, j, normals, offsets, first_face[e],
                             first_face[e + 1], units, row)  # fmt: skip
            missing = cap - min(best, cap)
            safety_cost[c, i] += (1.0 - lam[c, i]) * missing
            if j >= 0:
                safety_cost[c, j] += (1.0 - lam[c, j]) * missing


@njit(cache=True)
def _move(
    state_axes, input_axes, state, status, clock, action, noise, A, B, root, separable,
    control_set, projection, low, high, edges, first_edge, input_normals, input_offsets,
    first_input, goal, goal_size, tolerance, schedule, scheduled, lam, arrived, time_cost,
):  # fmt: skip
    """Move by x' = A x + B u + root noise those in traffic, who pay for it; see who arrives."""
    C, N = status.shape
    n, m = len(state_axes), len(input_axes)
    u, moved = np.empty(m), np.empty(n)
    for c in range(C):
        held = min(clock[c], control_set.shape[0] - 1)
        clock[c] += 1
        for i in range(N):
            arrived[c, i] = False
            if status[c, i] != TRAFFIC:
                time_cost[c, i] = 0.0
                continue
            time_cost[c, i] = lam[c, i]
            v = control_set[held, i]
            kind = projection[v]
            if separable[i]:  # the paper's case: every axis by itself, nothing kept in between
                for k in range(n):
                    push = action[c, i, k]
                    if kind == BOX:
                        push = min(max(push, low[v, k]), high[v, k])
                    value = A[i, k, k] * state[c, i, k] + root[i, k, k] * noise[c, i, k]
                    state[c, i, k] = value + B[i, k, k] * push
            else:
                for k in range(m):
                    u[k] = action[c, i, k]
                    if kind == BOX:
                        u[k] = min(max(u[k], low[v, k]), high[v, k])
                if kind == POLYGON:
                    _to_polygon(edges, first_edge[v], first_edge[v + 1], u)
                elif kind == FACES:
                    first, last = first_input[v], first_input[v + 1]
                    _hildreth(input_normals, input_offsets, first, last, u)
                for k in range(n):
                    value = 0.0
                    for q in range(n):
                        value += A[i, k, q] * state[c, i, q] + root[i, k, q] * noise[c, i, q]
                    for q in range(m):
                        value += B[i, k, q] * u[q]
                    moved[k] = value
                for k in range(n):
                    state[c, i, k] = moved[k]
            there = clock[c] >= schedule[i]
            if not scheduled:  # spelled out: a call for every agent doubles the time of a step
                there = True
                for k in range(goal_size[i]):
                    there = there and abs(state[c, i, k] - goal[i, k]) <= tolerance
            if there:
                status[c, i] = ARRIVED
                arrived[c, i] = True


@njit(cache=True)
def _collide(axes, state, status, pair, normals, depths, first_face, stay, crashed, overlap):
    """Which bodies overlap by more than a touch, and who crashed; the parked are at peace."""
    C, N = status.shape
    for c in range(C):
        for i in range(N):
            crashed[c, i] = False
        for e in range(pair.shape[0]):
            i, j = pair[e, 0], pair[e, 1]
            overlap[c, e] = False
            first = status[c, i]
            other = status[c, j] if j >= 0 else ARRIVED
            if first != TRAFFIC and other != TRAFFIC:
                continue
            if first == CRASHED or other == CRASHED:
                continue
            if not stay and (first == ARRIVED or (j >= 0 and other == ARRIVED)):
                continue
            if j < 0 and first != TRAFFIC:
                continue
            if inside(axes, state, c, i, j, normals, depths, first_face[e], first_face[e + 1]):
                overlap[c, e] = True
                crashed[c, i] = True
                if j >= 0:
                    crashed[c, j] = True


@njit(cache=True)
def _settle(
    status, alive, clock, crashed, lam, crash_cost, margin_reward, remove_crashed,
    stay, social, max_cycles, time_cost, safety_cost, reward, terminated, truncated, over,
):  # fmt: skip
    """Pay, and end the episodes of those who have arrived or crashed, or whose time is up."""
    C, N = status.shape
    for c in range(C):
        busy, total = False, 0.0
        for i in range(N):
            if not margin_reward:
                safety_cost[c, i] = (1.0 - lam[c, i]) * crash_cost if crashed[c, i] else 0.0
            if crashed[c, i] and remove_crashed:
                status[c, i] = CRASHED
            busy = busy or status[c, i] == TRAFFIC
            total += time_cost[c, i] + safety_cost[c, i]
        late = clock[c] >= max_cycles
        over[c] = not busy or late
        for i in range(N):
            reward[c, i] = 0.0
            terminated[c, i] = False
            truncated[c, i] = False
            if not alive[c, i]:
                continue
            reward[c, i] = -(total if social else time_cost[c, i] + safety_cost[c, i])
            gone = status[c, i] == CRASHED or (status[c, i] == ARRIVED and not stay)
            terminated[c, i] = not busy or (gone and not social)
            truncated[c, i] = late and not terminated[c, i]
            alive[c, i] = not (terminated[c, i] or truncated[c, i])


@njit(cache=True)
def _to_polygon(edges, first, last, u):
    """Replace ``u`` by the nearest point of a polygon: the best on an edge that it lies beyond.

    Rows of ``edges``: corner (2), unit tangent (2) counter-clockwise, length.
    """
    x, y, best, bx, by = u[0], u[1], np.inf, u[0], u[1]
    for v in range(first, last):
        cx, cy, tx, ty = edges[v, 0], edges[v, 1], edges[v, 2], edges[v, 3]
        if (x - cx) * ty - (y - cy) * tx <= 0.0:
            continue  # on the inner side of this edge
        along = min(max((x - cx) * tx + (y - cy) * ty, 0.0), edges[v, 4])
        px, py = cx + along * tx, cy + along * ty
        far = (x - px) ** 2 + (y - py) ** 2
        if far < best:
            best, bx, by = far, px, py
    u[0], u[1] = bx, by


@njit(cache=True)
def _hildreth(normals, offsets, first, last, u):
    """Hildreth's method: coordinate ascent on the dual of min |v - u|^2 over the half-spaces."""
    price = np.zeros(last - first)
    for _ in range(SWEEPS):
        change = 0.0
        for f in range(first, last):
            reach = -offsets[f]
            for k in range(u.size):
                reach += normals[f, k] * u[k]
            amount = max(reach, -price[f - first])
            price[f - first] += amount
            for k in range(u.size):
                u[k] -= amount * normals[f, k]
            change = max(change, abs(amount))
        if change < SETTLED:
            return
