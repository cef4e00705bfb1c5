"""The compiled inner loop: one step of many copies of a game.

The single environment and the batched simulator both run this loop.  Noise is an argument, so
that the two can be compared draw by draw.  Each function is one phase of the step and runs over
all copies C and agents N.  The functions take plain arrays, because passing a tuple of forty
arrays between compiled functions costs more than the work inside.  Numba compiles at first use
and keeps the machine code on disk.

Dimensions are passed as tuples of that length (``state_axes`` of n zeros, and so on): the length
of a tuple is part of its type, so the compiler unrolls the loops over components.

Arrays: ``state`` (C, bodies, n), of the agents and then of the moving obstacles; ``before``
likewise, before the move (with swept collisions); ``status`` (C, N) with the codes of
:mod:`ppg_env.env.status`; ``parked`` (C, N) times of arrival; ``clock`` (C,); ``lam`` (C, N);
``g`` holds the game and its rules (:class:`ppg_env.env.arrays.Tables`).  Starts, goals and noise
are the same in all copies, N rows, or one's own in each, C N rows.
"""

from __future__ import annotations

import numpy as np

from ppg_env.env.arrays import BOX, FACES, NEVER, POLYGON, Tables
from ppg_env.env.broad_phase import sweep
from ppg_env.env.encounters import collide, price_margins
from ppg_env.env.observation import write_observations, write_obstacles
from ppg_env.env.projection import project_on_faces, project_on_polygon
from ppg_env.env.status import ARRIVED, CRASHED, MISSING, TRAFFIC
from ppg_env.support.compilation import njit
from ppg_env.tolerances import LARGEST

_write_observations = njit(cache=True)(write_observations)
_write_obstacles = njit(cache=True)(write_obstacles)

SHARED, OWN = (), (0,)
"""Whether copies share the rows of an array, or each has its own: by the lengths of these tuples
the compiler makes two functions of one, of which the first pays nothing for the second."""


@njit(inline="always")
def _observe(g, marks, marked, state, status, clock, out):
    """Write the observations of the copies whose mark is ``marked``."""
    if g.goal.shape[0] > status.shape[1]:
        _write_observations(OWN, g.state_axes, g.axes, marks, marked, state, status, clock, g.goal,
                            g.agent_codes[0], g.centre, g.scale, g.max_cycles, g.stay,
                            out)  # fmt: skip
    else:
        _write_observations(SHARED, g.state_axes, g.axes, marks, marked, state, status, clock,
                            g.goal, g.agent_codes[0], g.centre, g.scale, g.max_cycles, g.stay,
                            out)  # fmt: skip
    if g.path.size:
        _write_obstacles(g.axes, marks, marked, state, clock, g.path, g.obstacle_times, g.scale,
                         out)  # fmt: skip


@njit(cache=True)
def all_usable(action):
    """Return whether all entries are numbers of at most ``LARGEST`` in size, hence finite."""
    usable, flat = True, action.reshape(-1)
    for k in range(flat.size):  # without a branch, so that the compiler uses vectors
        usable &= abs(flat[k]) <= LARGEST
    return usable


@njit(cache=True)
def step(
    g: Tables, state, before, status, parked, alive, clock, lam, action, noise, restarting,
    start_noise, reward, time_cost, safety_cost, arrived, crashed, overlap, terminated, truncated,
    acting, over, observation, final_observation,
):  # fmt: skip
    """Step every copy; with ``restarting``, start the next episode where one is over.

    ``terminated`` and ``alive`` follow the life-cycle of the rules.  Agents at the time limit are
    ``truncated`` and no longer alive; ``over`` marks copies whose episode has ended.
    """
    acting[:] = alive
    if g.swept:
        before[:] = state
    if g.margin_reward and not g.swept:
        price_margins(g.axes, state, state, status, arrived, parked, clock, False, g.stay,
                      g.obstacle_times, lam, g.margin_cap, g.pair, g.normals, g.offsets,
                      g.units, safety_cost)  # fmt: skip
    if g.goal.shape[0] > status.shape[1]:
        _move(OWN, g.state_axes, g.input_axes, state, status, parked, clock, action, noise, g.A,
              g.B, g.root, g.control_set, g.projection, g.limits, g.edges, g.input_normals,
              g.input_offsets, g.first_row, g.goal, g.agent_codes, g.tolerance, g.scheduled, lam,
              g.effort, arrived, time_cost)  # fmt: skip
    else:
        _move(SHARED, g.state_axes, g.input_axes, state, status, parked, clock, action, noise, g.A,
              g.B, g.root, g.control_set, g.projection, g.limits, g.edges, g.input_normals,
              g.input_offsets, g.first_row, g.goal, g.agent_codes, g.tolerance, g.scheduled, lam,
              g.effort, arrived, time_cost)  # fmt: skip
    if g.obstacle_times.size:
        _move_obstacles(g.state_axes, state, status.shape[1], clock, noise, g.path,
                        g.obstacle_times, g.root, g.drifting)  # fmt: skip
    if g.margin_reward and g.swept:
        price_margins(g.axes, before, state, status, arrived, parked, clock, True, g.stay,
                      g.obstacle_times, lam, g.margin_cap, g.pair, g.normals, g.offsets,
                      g.units, safety_cost)  # fmt: skip
    if g.extents.size:
        sweep(g.axes, before, state, status, arrived, clock, g.swept, g.stay, g.obstacle_times,
              g.pair, g.own_faces, g.normals, g.depths, g.extents, crashed, overlap)  # fmt: skip
    elif g.own_faces:
        collide(OWN, g.axes, before, state, status, arrived, clock, g.swept, g.stay,
                g.obstacle_times, g.pair, g.own_faces, g.normals, g.depths, crashed,
                overlap)  # fmt: skip
    else:
        collide(SHARED, g.axes, before, state, status, arrived, clock, g.swept, g.stay,
                g.obstacle_times, g.pair, g.own_faces, g.normals, g.depths, crashed,
                overlap)  # fmt: skip
    _settle(status, alive, clock, arrived, crashed, lam, g.crash_cost, g.margin_reward,
            g.remove_crashed, g.swept, g.stay, g.last_motion, g.social, g.max_cycles, time_cost,
            safety_cost, reward, terminated, truncated, over)  # fmt: skip
    _observe(g, over, False, state, status, clock, observation)
    _observe(g, over, True, state, status, clock, final_observation if restarting else observation)
    if restarting:
        begin(g, over, state, status, parked, alive, clock, start_noise, observation)


@njit(cache=True)
def begin(g: Tables, chosen, state, status, parked, alive, clock, noise, observation):
    """Reset the ``chosen`` copies; ``noise`` (C, bodies, n) is read if starts are random."""
    _restart(g.state_axes, chosen, state, status, parked, alive, clock, noise, g.playing, g.start,
             g.start_root, g.random_start, g.goal, g.agent_codes, g.tolerance, g.scheduled,
             g.path)  # fmt: skip
    _observe(g, chosen, True, state, status, clock, observation)


@njit(cache=True)
def _restart(
    state_axes, chosen, state, status, parked, alive, clock, noise, playing, start, root, random,
    goal, agent_codes, tolerance, scheduled, path,
):  # fmt: skip
    """Put all bodies at their starts; an agent whose start is its goal arrives at time 0."""
    C, N = status.shape
    n, goal_size, schedule = len(state_axes), agent_codes[0], agent_codes[1]
    last = start.shape[0] - N
    for c in range(C):
        if not chosen[c]:
            continue
        clock[c] = 0
        row = min(c * N, last)
        for i in range(N):
            status[c, i] = TRAFFIC
            parked[c, i] = NEVER
            alive[c, i] = True
            for k in range(n):
                value = start[row + i, k]
                if random:
                    for q in range(n):
                        value += root[i, k, q] * noise[c, i, q]
                state[c, i, k] = value
            at_goal = schedule[i] <= 0
            if not scheduled:
                at_goal = True
                for k in range(goal_size[i]):
                    away = abs(state[c, i, k] - goal[row + i, k])
                    at_goal = at_goal and away <= tolerance[i, k]
            if not playing[row + i]:
                status[c, i] = MISSING
                alive[c, i] = False
            elif at_goal:
                status[c, i] = ARRIVED
                parked[c, i] = 0
        for b in range(path.shape[0]):
            for k in range(n):
                state[c, N + b, k] = path[b, 0, k]


@njit(cache=True)
def _move(
    own_rows, state_axes, input_axes, state, status, parked, clock, action, noise, A, B, root,
    control_set, projection, limits, edges, input_normals, input_offsets, first_row, goal,
    agent_codes, tolerance, scheduled, lam, effort, arrived, time_cost,
):  # fmt: skip
    """Move agents in traffic by x' = A x + B u + root noise; charge time and effort, flag arrivals.

    Effort is that of the applied input u.
    """
    C, N = status.shape
    n, m = len(state_axes), len(input_axes)
    low, high, first_edge, first_input = limits[0], limits[1], first_row[0], first_row[1]
    goal_size, schedule, separable = agent_codes[0], agent_codes[1], agent_codes[2]
    inputs = agent_codes[3]
    u, moved = np.empty(m), np.empty(n)
    for c in range(C):
        row = min(clock[c], control_set.shape[0] - 1)
        own = c * N * len(own_rows)
        clock[c] += 1
        for i in range(N):
            arrived[c, i] = False
            if status[c, i] != TRAFFIC:
                time_cost[c, i] = 0.0
                continue
            time_cost[c, i] = lam[c, i]
            v = control_set[row, i]
            kind = projection[v]
            asked = 0.0
            if separable[i]:  # the paper's case: axes do not interact, no copy is needed
                for k in range(n):
                    push = action[c, i, k]
                    if kind == BOX:
                        push = min(max(push, low[v, k]), high[v, k])
                    value = A[i, k, k] * state[c, i, k] + root[own + i, k, k] * noise[c, i, k]
                    state[c, i, k] = value + B[i, k, k] * push
                    asked += abs(push)
            else:
                for k in range(m):
                    u[k] = action[c, i, k] if k < inputs[i] else 0.0
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
                        value += A[i, k, q] * state[c, i, q] + root[own + i, k, q] * noise[c, i, q]
                    for q in range(m):
                        value += B[i, k, q] * u[q]
                    moved[k] = value
                for k in range(n):
                    state[c, i, k] = moved[k]
                for k in range(m):
                    asked += abs(u[k])
            if effort[i] > 0.0:
                time_cost[c, i] += effort[i] * asked
            at_goal = clock[c] >= schedule[i]
            if not scheduled:  # inlined by hand: a call per agent doubles the time of a step
                at_goal = True
                for k in range(goal_size[i]):
                    away = abs(state[c, i, k] - goal[own + i, k])
                    at_goal = at_goal and away <= tolerance[i, k]
            if at_goal:
                status[c, i] = ARRIVED
                arrived[c, i] = True
                parked[c, i] = clock[c]


@njit(cache=True)
def _move_obstacles(
    state_axes, state, agents, clock, noise, path, obstacle_times, root, drifting
):  # fmt: skip
    """Move obstacles along their paths; with noise they drift, by root noise per step to rest."""
    n, first_root = len(state_axes), root.shape[0] - path.shape[0]
    for c in range(clock.size):
        for b in range(path.shape[0]):
            t, body = clock[c], agents + b
            if t > obstacle_times[b, 0]:
                continue
            for k in range(n):
                if not drifting:
                    state[c, body, k] = path[b, t, k]
                    continue
                state[c, body, k] += path[b, t, k] - path[b, t - 1, k]
                for q in range(n):
                    state[c, body, k] += root[first_root + b, k, q] * noise[c, body, q]


@njit(cache=True)
def _settle(
    status, alive, clock, arrived, crashed, lam, crash_cost, margin_reward, remove_crashed, swept,
    stay, last_motion, social, max_cycles, time_cost, safety_cost, reward, terminated, truncated,
    over,
):  # fmt: skip
    """Pay rewards; end the episodes of agents that arrived, crashed or reached the time limit."""
    C, N = status.shape
    for c in range(C):
        busy, total = False, 0.0
        waiting = stay and clock[c] < last_motion  # an obstacle may still hit a parked body
        for i in range(N):
            if not margin_reward:
                safety_cost[c, i] = (1.0 - lam[c, i]) * crash_cost if crashed[c, i] else 0.0
            if crashed[c, i] and remove_crashed:
                status[c, i] = CRASHED
                if swept:
                    arrived[c, i] = False
            busy = busy or status[c, i] == TRAFFIC or (waiting and status[c, i] == ARRIVED)
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
