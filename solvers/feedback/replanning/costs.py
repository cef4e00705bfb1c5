"""Compiled: what crashes cost in the choice of an agent.

``g`` is a :class:`solvers.feedback.replanning.meetings.Meetings`; ``means`` (N, Q, L + 1, n) and
``alive`` (N, Q, L + 1) are those of Q candidates for each agent, of which ``chosen`` (N,) are the
plans now.
"""

from __future__ import annotations

from ppg_env.support.compilation import njit
from solvers.feedback.replanning.risk import meeting_risk


@njit(cache=True)
def pair_risk(g, e, first, second, first_alive, second_alive, steps):
    """Return the crash probability of encounter ``e`` for the means of its bodies."""
    return meeting_risk(
        first, second, first_alive, second_alive, steps, g.swept, g.stay, g.dim, g.normals,
        g.offsets, g.pair[e, 2], g.pair[e, 3], g.opposite, g.box[e],
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

    Obstacles keep their present distance from their paths; the last row is the obstacle at rest,
    which always counts.
    """
    N, L = parked.size, means.shape[1] - 1
    for i in range(N):
        steps[i] = L if parked[i] else 0
        for t in range(L + 1):
            for a in range(state.shape[1]):
                means[i, t, a] = state[i, a]
    steps[-1] = L
    for k in range(g.path.shape[0]):
        rest, until = g.obstacle_times[k]
        longest = g.path.shape[1] - 1
        steps[N + k] = min(L, max(until - clock - 1 + g.swept, 0))
        for t in range(L + 1):
            alive[N + k, t] = 1.0 if clock + t < rest or not g.stay else 0.0
            for a in range(g.dim):
                ahead = g.path[k, min(clock + t, longest), a]
                means[N + k, t, a] = ahead + obstacles[k, a] - g.path[k, min(clock, longest), a]


@njit(cache=True)
def add_fixed(g, social, lam, i, bodies, bodies_alive, steps, means, alive):
    """Return the expected cost of crashes of agent i with bodies that do not plan."""
    N, cost = lam.size, 0.0
    for e in range(g.pair.shape[0]):
        one, two = g.pair[e, 0], g.pair[e, 1]
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
        one, two = g.pair[e, 0], g.pair[e, 1]
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
