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

from ppg_env.support.compilation import njit
from solvers.feedback.replanning.costs import add_fixed, crash_cost, fixed_bodies, pair_risk, price
from solvers.feedback.replanning.risk import meeting_risk
from solvers.feedback.replanning.rollout import GO, KEEP, TRACK, roll

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
    i, j = g.pair[e, 0], g.pair[e, 1]
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
    normals, offsets, start, stop = g.normals, g.offsets, g.pair[e, 2], g.pair[e, 3]
    opposite, box, deviations, tail = g.opposite, g.box[e], g.deviations, g.tail
    swept, stay, d = g.swept, g.stay, g.dim
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
    """Choose candidates (N,) of all agents; the first ones are the plans so far."""
    N, L = lam.size, means.shape[2] - 1
    for i in range(N):
        chosen[i] = 0
    if social:
        for e in range(g.pair.shape[0]):
            i, j = g.pair[e, 0], g.pair[e, 1]
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
def roll_candidates(
    motion, g, social, i, state, clock, lam, kept, kept_steps, first_round, size, bodies,
    bodies_alive, steps, means, inputs, alive, base, scratch,
):  # fmt: skip
    """Roll out all candidates of agent i; write their costs ``base`` (Q,) without other agents.

    ``means[:, 0]`` becomes the present ``state``.
    """
    moves = motion.moves.shape[1]
    for q in range(base.size):
        start, stop, move, after = 0, 0, 0, GO if first_round else KEEP
        if q >= STANDING:
            start, stop = motion.windows[(q - STANDING) // moves]
            move = (q - STANDING) % moves
        elif q == 0:
            after = KEEP if kept_steps > 0 else TRACK
        else:
            after = TRACK if q == 1 else GO
        for b in range(state.size):
            means[q, 0, b] = state[b]
        base[q] = roll(motion, i, clock, lam[i], kept, kept_steps, start, stop, move, size, after,
                       means[q], inputs[q], alive[q], scratch)  # fmt: skip
        base[q] += add_fixed(g, social, lam, i, bodies, bodies_alive, steps, means[q], alive[q])


@njit(cache=True)
def keep(inputs, alive, kept, kept_steps, i, action):
    """Store the inputs (L, m) of agent i for the next round or step, and the first one to play."""
    kept_steps[i] = 0
    for t in range(kept.shape[0]):
        kept_steps[i] += alive[t] > 0.0
        for a in range(kept.shape[1]):
            kept[t, a] = inputs[t, a]
    for a in range(action.size):
        action[a] = inputs[0, a]


@njit(cache=True)
def plan(
    motion, g, social, state, moving, parked, obstacles, clock, lam, kept, kept_steps, action
):  # fmt: skip
    """Plan for all agents in all copies; write first inputs (C, N, m) and the plans.

    ``kept`` (C, N, L, m) and ``kept_steps`` (C, N) are earlier plans from now on, without steps
    where there is none; they are replaced.
    """
    C, N, L, m = kept.shape
    n, rows = state.shape[2], N + g.path.shape[0] + 1
    Q = STANDING + motion.windows.shape[0] * motion.moves.shape[1]
    means, inputs = np.zeros((N, Q, L + 1, n)), np.zeros((N, Q, L, m))
    alive, base, scratch = np.zeros((N, Q, L + 1)), np.zeros((N, Q)), np.zeros((3, max(n, m)))
    bodies, bodies_alive = np.zeros((rows, L + 1, n)), np.zeros((rows, L + 1))
    steps, chosen = np.zeros(rows, np.int64), np.zeros(N, np.int64)
    for c in range(C):
        fixed_bodies(g, state[c], obstacles[c], parked[c], clock[c], bodies, bodies_alive, steps)
        for r in range(len(SIZES)):
            for i in range(N):
                if moving[c, i]:
                    roll_candidates(
                        motion, g, social, i, state[c, i], clock[c], lam[c], kept[c, i],
                        kept_steps[c, i], r == 0, SIZES[r], bodies, bodies_alive, steps, means[i],
                        inputs[i], alive[i], base[i], scratch,
                    )  # fmt: skip
            choose(g, social, lam[c], moving[c], chosen, means, alive, base)
            settled = True
            for i in range(N):
                if moving[c, i]:
                    q = chosen[i]
                    settled = settled and base[i, q] <= base[i, np.argmin(base[i])] + CONFLICT
                    keep(inputs[i, q], alive[i, q], kept[c, i], kept_steps[c], i, action[c, i])
            if settled:  # no agent gives way to another: there is nothing to refine
                break
