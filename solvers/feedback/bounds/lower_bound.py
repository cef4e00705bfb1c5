r"""Proved lower bounds on the expected cost of any players in the environment.

The cost of an agent is lam per step in traffic, its effort, and (1 - lam) kappa at a crash.
Whatever the others do, and whatever the agent sees, it is at least the least cost of the agent
alone who may, in addition, leave after any step at the cost of a crash: a crash does nothing else
to it, and an agent that is not removed pays for crashes and goes on.  Hence, for any players,

    cost_i >= solo_i,     sum_i cost_i >= sum_i solo_i,     regret_i <= cost_i - solo_i.

What the agents lose to each other is not in these bounds: they are close where agents pass at
ease, and loose where they meet.  For two agents in the plane
:mod:`solvers.feedback.bounds.pair_bound` adds what a detour or a crash costs them before one can
arrive.

``solo_i`` is bounded from below on a grid (:mod:`solvers.feedback.bounds.solo_grid`) of one or two
state components.  Larger states are relaxed: any components whose motion does not depend on the
others are a problem of their own, and the best bound of all of these counts.  Without noise the
number of steps follows from linear programs.  Obstacles are left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.arrival_regions import checked_tolerances
from ppg_env.env.rules import Rules
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from solvers.feedback.bounds.pair_bound import pair_lower_bound
from solvers.feedback.bounds.solo_table import solo_table


def solo_lower_bound(game: Game, agent: int, rules: Rules | None = None) -> float:
    """Return a proved lower bound on the expected cost of ``agent``, whatever all players do.

    It also bounds the cost of the agent's best response to any players.
    """
    rules = (Rules() if rules is None else rules).of(game)
    mover, steps = game.agents[agent], rules.steps(game)
    crash = (1 - mover.lam) * game.crash_cost
    leave = crash if rules.on_crash == "remove" else float("inf")
    if mover.lam == 0:
        return 0.0
    if rules.schedule is not None:
        due = min(rules.schedule[agent], steps)
        return min(mover.lam * due, mover.lam + leave) if due > 0 else 0.0
    tolerance = checked_tolerances(game, rules)[agent]
    if _at_goal(mover, mover.start, tolerance) and not mover.sigma0.any():
        return 0.0
    certain = 0.0 if mover.sigma0.any() else mover.lam
    if rules.saturation == "none":
        return certain
    if not (mover.noise.any() or mover.sigma0.any()):
        return _without_noise(mover, steps, tolerance, leave)
    return max(
        certain,
        *(
            mover.lam * solo_table(mover, block, steps, tolerance, leave=leave).bound
            for block in _blocks(mover)
        ),
        0.0,
    )


def social_lower_bound(game: Game, rules: Rules | None = None) -> float:
    """Return a proved lower bound on the expected sum of all agents' costs, for any players.

    It is the sum of what the agents need alone, with what pairs lose to each other where that is
    more: of disjoint pairs chosen greedily, or of all pairs, each shared out.
    """
    rules = (Rules() if rules is None else rules).of(game)
    solo = [solo_lower_bound(game, i, rules) for i in range(len(game.agents))]
    gains = sorted(
        (
            (pair_lower_bound(game, pair, rules) - solo[pair[0]] - solo[pair[1]], pair)
            for pair in combinations(range(len(solo)), 2)
        ),
        reverse=True,
    )
    used: set[int] = set()
    disjoint = 0.0
    for gain, pair in gains:
        if gain > 0 and not used & set(pair):
            disjoint += gain
            used |= set(pair)
    shared = sum(max(gain, 0.0) for gain, _ in gains) / max(len(solo) - 1, 1)
    return sum(solo) + max(disjoint, shared)


def _at_goal(agent: Agent, state: np.ndarray, tolerance: np.ndarray) -> bool:
    size = agent.goal.size
    return bool((np.abs(state[:size] - agent.goal) <= tolerance).all())


def _blocks(agent: Agent) -> Iterator[tuple[int, ...]]:
    """Yield components, one or two, whose motion does not depend on the others."""
    n = agent.state_dim
    for size in (1, 2) if n != 2 else (2, 1):
        for block in combinations(range(n), size):
            chosen, rest = list(block), [k for k in range(n) if k not in block]
            free = not agent.A[np.ix_(chosen, rest)].any()
            noise, start = (M[np.ix_(chosen, chosen)] for M in (agent.noise, agent.sigma0))
            plain = not (noise - np.diag(np.diag(noise))).any()
            plain = plain and not (start - np.diag(np.diag(start))).any()
            noisy = bool((np.diag(noise) > tol.DEVIATION**2).all())
            if free and plain and noisy and block[0] < agent.goal.size:
                yield block
                if size == n:
                    return


def _without_noise(agent: Agent, steps: int, tolerance: np.ndarray, leave: float) -> float:
    """Return the least cost of time and effort without noise, by linear programs."""
    first = agent.lam + leave
    best = min(first, agent.lam * steps)
    for count in range(1, steps + 1):
        if agent.lam * count >= best:
            break
        effort = _least_effort(agent, count, tolerance + tol.LENGTH * agent.unit)
        if effort is not None:
            best = min(best, agent.lam * count + agent.effort * effort)
            if agent.effort == 0:
                break
    return best


def _least_effort(agent: Agent, count: int, tolerance: np.ndarray) -> float | None:
    """Return the least sum of |u|_1 over ``count`` steps into the region; None if there is none."""
    from scipy.optimize import linprog

    n, m, g = agent.state_dim, agent.control_dim, agent.goal.size
    effects: list[np.ndarray] = []
    power = np.eye(n)
    for _ in range(count):
        effects.insert(0, (power @ agent.B)[:g])
        power = power @ agent.A
    reach, drift = np.hstack(effects), (power @ agent.start)[:g] - agent.goal
    rows, limits = [reach, -reach], [tolerance - drift, tolerance + drift]
    faces = np.zeros((0, count * m))
    for t in range(count):
        control = agent.control_at(t)
        block = np.zeros((len(control.offsets), count * m))
        block[:, t * m : (t + 1) * m] = control.normals
        faces = np.vstack([faces, block])
        limits.append(control.offsets)
    rows.append(faces)
    size = count * m
    sizes = [np.hstack([sign * np.eye(size), -np.eye(size)]) for sign in (1.0, -1.0)]
    bounds = np.vstack([*(np.hstack([row, np.zeros((len(row), size))]) for row in rows), *sizes])
    limits += [np.zeros(2 * size)]
    cost = np.concatenate([np.zeros(size), np.ones(size)])
    solution = linprog(cost, bounds, np.concatenate(limits), bounds=(None, None))
    return None if solution.status == 2 else float(solution.fun or 0.0)
