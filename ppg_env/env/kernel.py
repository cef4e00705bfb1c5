"""The compiled inner loop: one step of many copies of a game.

The single environment and the batched simulator both run this loop.  Noise is an argument, so
that the two can be compared draw by draw.  Each function is one phase of the step and runs over
all copies C and agents N.  The functions take plain arrays, because passing a tuple of forty
arrays between compiled functions costs more than the work inside.  Numba compiles at first use
and keeps the machine code on disk.

Dimensions are passed as tuples of that length (``state_axes`` of n zeros, and so on): the length
of a tuple is part of its type, so the compiler unrolls the loops over components.

Arrays: ``state`` (C, N, n), ``status`` (C, N) with the codes of :mod:`ppg_env.env.status`,
``clock`` (C,), ``lam`` (C, N); ``g`` holds the game and its rules
(:class:`ppg_env.env.arrays.Tables`).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ppg_env.env.arrays import BOX, FACES, POLYGON, Tables
from ppg_env.env.observation import write_observations
from ppg_env.env.projection import project_on_faces, project_on_polygon
from ppg_env.env.status import ARRIVED, CRASHED, TRAFFIC
from ppg_env.game.compiled_margins import best_face, inside

_observe = njit(cache=True)(write_observations)


@njit(cache=True)
def step(
    g: Tables, state, status, alive, clock, lam, action, noise, restarting, start_noise,
    reward, time_cost, safety_cost, arrived, crashed, overlap, terminated, truncated, acting, over,
    observation, final_observation,
):  # fmt: skip
    """Step every copy; with ``restarting``, start the next episode where one is over.

    ``terminated`` and ``alive`` follow the life-cycle of the rules.  Agents at the time limit are
    ``truncated`` and no longer alive; ``over`` marks copies whose episode has ended.
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
    """Reset the ``chosen`` copies; ``noise`` (C, N, n) is read if starts are random."""
    _restart(g.state_axes, chosen, state, status, alive, clock, noise, g.start, g.start_root,
             g.random_start, g.goal, g.goal_size, g.tolerance, g.schedule, g.scheduled)  # fmt: skip
    _observe(g.state_axes, g.axes, chosen, True, state, status, clock, g.goal, g.goal_size,
             g.centre, g.scale, g.max_cycles, g.stay, observation)  # fmt: skip


@njit(cache=True)
def _restart(
    state_axes, chosen, state, status, alive, clock, noise, start, root, random,
    goal, goal_size, tolerance, schedule, scheduled,
):  # fmt: skip
    """Put all agents at their starts; an agent whose start is its goal arrives at time 0."""
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
            at_goal = schedule[i] <= 0
            if not scheduled:
                at_goal = True
                for k in range(goal_size[i]):
                    at_goal = at_goal and abs(state[c, i, k] - goal[i, k]) <= tolerance
            if at_goal:
                status[c, i] = ARRIVED


@njit(cache=True)
def _price_margins(
    axes, status, clock, state, lam, cap, pair, normals, offsets, first_face, units,
    safety_cost,
):  # fmt: skip
    """Charge agents in traffic for margins below the cap, before they move."""
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
    """Move agents in traffic by x' = A x + B u + root noise, charge time, flag arrivals."""
    C, N = status.shape
    n, m = len(state_axes), len(input_axes)
    u, moved = np.empty(m), np.empty(n)
    for c in range(C):
        row = min(clock[c], control_set.shape[0] - 1)
        clock[c] += 1
        for i in range(N):
            arrived[c, i] = False
            if status[c, i] != TRAFFIC:
                time_cost[c, i] = 0.0
                continue
            time_cost[c, i] = lam[c, i]
            v = control_set[row, i]
            kind = projection[v]
            if separable[i]:  # the paper's case: axes do not interact, no copy is needed
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
                    project_on_polygon(edges, first_edge[v], first_edge[v + 1], u)
                elif kind == FACES:
                    first, last = first_input[v], first_input[v + 1]
                    project_on_faces(input_normals, input_offsets, first, last, u)
                for k in range(n):
                    value = 0.0
                    for q in range(n):
                        value += A[i, k, q] * state[c, i, q] + root[i, k, q] * noise[c, i, q]
                    for q in range(m):
                        value += B[i, k, q] * u[q]
                    moved[k] = value
                for k in range(n):
                    state[c, i, k] = moved[k]
            at_goal = clock[c] >= schedule[i]
            if not scheduled:  # inlined by hand: a call per agent doubles the time of a step
                at_goal = True
                for k in range(goal_size[i]):
                    at_goal = at_goal and abs(state[c, i, k] - goal[i, k]) <= tolerance
            if at_goal:
                status[c, i] = ARRIVED
                arrived[c, i] = True


@njit(cache=True)
def _collide(axes, state, status, pair, normals, depths, first_face, stay, crashed, overlap):
    """Flag overlapping pairs and crashed agents; pairs of parked agents are skipped."""
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
    """Pay rewards; end the episodes of agents that arrived, crashed or reached the time limit."""
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
            left = status[c, i] == CRASHED or (status[c, i] == ARRIVED and not stay)
            terminated[c, i] = not busy or (left and not social)
            truncated[c, i] = late and not terminated[c, i]
            alive[c, i] = not (terminated[c, i] or truncated[c, i])
