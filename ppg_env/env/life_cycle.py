"""Compiled: the start of an episode, and what a step pays and ends.

Arguments are as in :mod:`ppg_env.env.kernel`.
"""

from __future__ import annotations

import numpy as np

from ppg_env.env.arrays import NEVER
from ppg_env.env.status import ARRIVED, CRASHED, MISSING, TRAFFIC
from ppg_env.support.compilation import njit


@njit(cache=True)
def restart(
    state_axes, first, last, chosen, state, status, parked, alive, clock, noise, playing, start,
    root, random, goal, agent_codes, tolerance, scheduled, path,
):  # fmt: skip
    """Put all bodies at their starts; an agent whose start is its goal arrives at time 0."""
    N = status.shape[1]
    n, goal_size, schedule = len(state_axes), agent_codes[0], agent_codes[1]
    last_row = start.shape[0] - N
    for c in range(first, last):
        if not chosen[c]:
            continue
        clock[c] = 0
        row = min(c * N, last_row)
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
def settle(
    first, last, status, alive, clock, arrived, crashed, lam, crash_cost, margin_reward,
    remove_crashed, swept, stay, last_motion, social, max_cycles, time_cost, safety_cost, reward,
    terminated, truncated, over,
):  # fmt: skip
    """Pay rewards; end the episodes of agents that arrived, crashed or reached the time limit.

    Loops over all agents of all copies choose values without branches, so that the processor works
    on several at a time.
    """
    N = status.shape[1]
    codes, acts = status[first:last].reshape(-1), alive[first:last].reshape(-1)
    there, hit = arrived[first:last].reshape(-1), crashed[first:last].reshape(-1)
    weights, rewards = lam[first:last].reshape(-1), reward[first:last].reshape(-1)
    times, risks = time_cost[first:last].reshape(-1), safety_cost[first:last].reshape(-1)
    ended, cut = terminated[first:last].reshape(-1), truncated[first:last].reshape(-1)
    closing = np.zeros(codes.size, np.int8)
    if not margin_reward:
        for p in range(codes.size):
            cost = (1.0 - weights[p]) * crash_cost
            risks[p] = cost if hit[p] else 0.0
    if remove_crashed:
        for p in range(codes.size):
            codes[p] = CRASHED if hit[p] else codes[p]
        if swept:
            for p in range(codes.size):
                there[p] = there[p] & (not hit[p])
    for p in range(codes.size):
        own = -(times[p] + risks[p])
        rewards[p] = own if acts[p] else 0.0
    for c in range(last - first):
        time, busy, total = clock[first + c], False, 0.0
        waiting = stay & (time < last_motion)  # an obstacle may still hit a parked body
        for p in range(c * N, c * N + N):
            busy = busy | (codes[p] == TRAFFIC) | (waiting & (codes[p] == ARRIVED))
        late = time >= max_cycles
        over[first + c] = late | (not busy)
        for p in range(c * N, c * N + N):
            closing[p] = 2 * late + (not busy)
        if social:
            for p in range(c * N, c * N + N):
                total += times[p] + risks[p]
            for p in range(c * N, c * N + N):
                rewards[p] = -total if acts[p] else 0.0
    for p in range(codes.size):
        left = ((codes[p] == CRASHED) | ((codes[p] == ARRIVED) & (not stay))) & (not social)
        end = acts[p] & (left | ((closing[p] & 1) > 0))
        truncate = acts[p] & (closing[p] >= 2) & (not end)
        ended[p] = end
        cut[p] = truncate
        acts[p] = acts[p] & (not (end | truncate))
