"""Compiled: joint plans of all agents from observed states, by search among candidates.

Each round rolls out candidates for every agent: the earlier plan, the tracked plan, the straight
way, and the current plan with another move in a window of steps.  A later round makes smaller
changes to what the last one chose.  Cost of an agent's plan:

    lam E[T] + effort + (1 - lam) kappa (probability of a crash with each other body)

``social``: the sum of all costs falls, over single agents and over pairs in conflict.
Otherwise agents take turns to respond to the others' plans with their own cost.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from solvers.feedback.plan_risk import meeting_risk
from solvers.feedback.plan_rollout import GO, KEEP, TRACK, roll

SIZES = (1.0, 0.4, 0.15)
"""Shares by which the rounds move inputs."""

SWEEPS = 4
"""Largest number of turns of each agent in a round."""

STANDING = 3
"""Candidates without a window: the earlier plan, the tracked one, the straight way."""

LEAST = 1e-9
"""Smallest improvement of a cost."""

CONFLICT = 1e-4
"""Plans of a pair are chosen together if those best alone cost more than this by their meeting."""


@njit(cache=True)
def pair_risk(g, e, first, second, first_alive, second_alive, steps):
    """Return the crash probability of encounter ``e`` for the means of its bodies."""
    return meeting_risk(
        first, second, first_alive, second_alive, steps, g.swept, g.stay, len(g.axes), g.normals,
        g.offsets, g.first_face[e], g.first_face[e + 1], g.opposite, g.box[e],
        g.deviations, g.tail,
    )  # fmt: skip


@njit(cache=True)
def price(g, social, lam, i, j):
    """Return what a crash of agent i with agent j (or with an obstacle) costs in i's choice."""
    weight = 1.0 - lam[i]
    if social and 0 <= j < lam.size:
        weight += 1.0 - lam[j]
    return weight * g.crash_cost


@njit(cache=True)
def fixed_bodies(g, state, obstacles, parked, clock, means, alive, steps):
    """Write the means (N + K + 1, L + 1, n) of bodies that do not plan, and until when they count.

    Obstacles keep their present distance from their paths; the last row is the obstacle at rest.
    """
    N, L = parked.size, means.shape[1] - 1
    means[:] = 0.0
    alive[:] = 0.0
    steps[:] = L
    for i in range(N):
        if not parked[i]:
            steps[i] = 0
        for t in range(L + 1):
            means[i, t] = state[i]
    for k in range(g.path.shape[0]):
        rest, until = g.obstacle_times[k]
        longest = g.path.shape[1] - 1
        steps[N + k] = min(L, max(until - clock - 1 + g.swept, 0))
        for t in range(L + 1):
            alive[N + k, t] = 1.0 if clock + t < rest or not g.stay else 0.0
            for a in range(len(g.axes)):
                ahead = g.path[k, min(clock + t, longest), a]
                means[N + k, t, a] = ahead + obstacles[k, a] - g.path[k, min(clock, longest), a]


@njit(cache=True)
def add_fixed(g, social, lam, i, bodies, bodies_alive, steps, means, alive):
    """Return the expected cost of crashes of agent i with bodies that do not plan."""
    N, cost = lam.size, 0.0
    for e in range(g.pair.shape[0]):
        one, two = g.pair[e]
        if two == i:
            if steps[one] and one < N:
                risk = pair_risk(g, e, bodies[one], means, bodies_alive[one], alive,
                                 steps[one])  # fmt: skip
                cost += risk * price(g, social, lam, i, one)
        elif one == i and steps[two]:
            risk = pair_risk(g, e, means, bodies[two], alive, bodies_alive[two],
                             steps[two])  # fmt: skip
            cost += risk * price(g, social, lam, i, two)
    return cost


@njit(cache=True)
def crash_cost(g, social, lam, i, c, skipped, moving, chosen, means, alive, bound):
    """Return what candidate c of agent i costs by crashes with the chosen plans of other agents.

    Agent ``skipped`` is left out; above ``bound`` any value above it is returned.
    """
    cost, L = 0.0, means.shape[2] - 1
    for e in range(g.pair.shape[0]):
        one, two = g.pair[e]
        other = two if one == i else one
        if (one != i and two != i) or not 0 <= other < lam.size:
            continue
        if other == skipped or not moving[other]:
            continue
        o = chosen[other]
        risk = pair_risk(
            g, e, means[one, c if one == i else o], means[two, c if two == i else o],
            alive[one, c if one == i else o], alive[two, c if two == i else o], L,
        )  # fmt: skip
        cost += risk * price(g, social, lam, i, other)
        if cost > bound:
            break
    return cost


@njit(cache=True)
def respond(g, social, lam, i, moving, chosen, means, alive, base):
    """Choose the best candidate of agent i against the others' plans; return if it is new."""
    current = chosen[i]
    best = base[i, current] + crash_cost(g, social, lam, i, current, -1, moving, chosen,
                                         means, alive, np.inf)  # fmt: skip
    for c in np.argsort(base[i]):
        if base[i, c] >= best - LEAST:
            break
        cost = base[i, c] + crash_cost(g, social, lam, i, c, -1, moving, chosen, means,
                                       alive, best - base[i, c])  # fmt: skip
        if cost < best - LEAST:
            best, chosen[i] = cost, c
    return chosen[i] != current


@njit(cache=True)
def choose_together(g, lam, e, moving, chosen, means, alive, base):
    """Choose the pair of candidates of the agents of encounter ``e`` with the least social cost."""
    i, j = g.pair[e]
    L, weight = means.shape[2] - 1, price(g, True, lam, i, j)
    alone = np.empty((2, base.shape[1]))
    for c in range(base.shape[1]):
        alone[0, c] = base[i, c] + crash_cost(g, True, lam, i, c, j, moving, chosen,
                                              means, alive, np.inf)  # fmt: skip
        alone[1, c] = base[j, c] + crash_cost(g, True, lam, j, c, i, moving, chosen,
                                              means, alive, np.inf)  # fmt: skip
    first, second = chosen[i], chosen[j]
    risk = pair_risk(g, e, means[i, first], means[j, second], alive[i, first],
                     alive[j, second], L)  # fmt: skip
    best = alone[0, first] + alone[1, second] + weight * risk
    # Locals: each use of a field of a tuple counts references.
    normals, offsets, start, stop = g.normals, g.offsets, g.first_face[e], g.first_face[e + 1]
    opposite, box, deviations, tail = g.opposite, g.box[e], g.deviations, g.tail
    swept, stay, d = g.swept, g.stay, len(g.axes)
    orders = np.argsort(alone[0]), np.argsort(alone[1])
    for a in orders[0]:
        if alone[0, a] + alone[1, orders[1][0]] >= best - LEAST:
            break
        first_means, first_alive = means[i, a], alive[i, a]
        for b in orders[1]:
            apart = alone[0, a] + alone[1, b]
            if apart >= best - LEAST:
                break
            risk = meeting_risk(
                first_means, means[j, b], first_alive, alive[j, b], L, swept, stay, d, normals,
                offsets, start, stop, opposite, box, deviations, tail,
            )  # fmt: skip
            if apart + weight * risk < best - LEAST:
                best, chosen[i], chosen[j] = apart + weight * risk, a, b


@njit(cache=True)
def choose(g, social, lam, moving, chosen, means, alive, base):
    """Improve the ``chosen`` candidates (N,) of all agents."""
    N, L = lam.size, means.shape[2] - 1
    if social:
        for e in range(g.pair.shape[0]):
            i, j = g.pair[e]
            if not 0 <= j < N or not moving[i] or not moving[j]:
                continue
            a, b = np.argmin(base[i]), np.argmin(base[j])
            risk = pair_risk(g, e, means[i, a], means[j, b], alive[i, a], alive[j, b], L)
            if risk * price(g, True, lam, i, j) > CONFLICT:
                choose_together(g, lam, e, moving, chosen, means, alive, base)
    for _ in range(SWEEPS):
        changed = False
        for i in range(N):
            if moving[i]:
                new = respond(g, social, lam, i, moving, chosen, means, alive, base)
                changed = changed or new
        if not changed:
            break


@njit(cache=True)
def plan(
    motion, g, social, state, moving, parked, obstacles, clock, lam, kept, kept_steps, action
):  # fmt: skip
    """Plan for all agents in all copies; write first inputs (C, N, m) and the plans.

    ``kept`` (C, N, L, m) and ``kept_steps`` (C, N) are earlier plans from now on, without steps
    where there is none; they are replaced.
    """
    C, N, L, m = kept.shape
    n, windows, moves = state.shape[2], motion.windows.shape[0], motion.moves.shape[1]
    Q = STANDING + windows * moves
    means, inputs = np.zeros((N, Q, L + 1, n)), np.zeros((N, Q, L, m))
    alive, base, scratch = np.zeros((N, Q, L + 1)), np.zeros((N, Q)), np.zeros((3, max(n, m)))
    rows = N + g.path.shape[0] + 1
    bodies, bodies_alive = np.zeros((rows, L + 1, n)), np.zeros((rows, L + 1))
    steps, chosen = np.zeros(rows, np.int64), np.zeros(N, np.int64)
    for c in range(C):
        fixed_bodies(g, state[c], obstacles[c], parked[c], clock[c], bodies, bodies_alive, steps)
        for r in range(len(SIZES)):
            for i in range(N):
                if not moving[c, i]:
                    continue
                q = 0
                for w in range(-STANDING, windows * moves):
                    window, move = (0, 0) if w < 0 else (w // moves, w % moves)
                    start, stop = motion.windows[window]
                    tail = GO if r == 0 else KEEP
                    if w < 0:
                        start, stop = 0, 0
                        tail = KEEP if q == 0 else TRACK if q == 1 else GO
                        if r == 0 and q == 0 and kept_steps[c, i] == 0:
                            tail = TRACK
                    means[i, q, 0] = state[c, i]
                    base[i, q] = roll(
                        motion, i, clock[c], lam[c, i], kept[c, i], kept_steps[c, i], start,
                        stop, move, SIZES[r], tail, means[i, q], inputs[i, q], alive[i, q],
                        scratch,
                    )  # fmt: skip
                    base[i, q] += add_fixed(
                        g, social, lam[c], i, bodies, bodies_alive, steps, means[i, q],
                        alive[i, q],
                    )  # fmt: skip
                    q += 1
            chosen[:] = 0
            choose(g, social, lam[c], moving[c], chosen, means, alive, base)
            settled = True
            for i in range(N):
                if moving[c, i]:
                    settled = settled and base[i, chosen[i]] <= np.min(base[i]) + CONFLICT
                    kept[c, i] = inputs[i, chosen[i]]
                    kept_steps[c, i] = np.sum(alive[i, chosen[i], :L] > 0.0)
            if settled:  # no agent gives way to another: there is nothing to refine
                break
        for i in range(N):
            if moving[c, i]:
                action[c, i] = kept[c, i, 0]
