"""Reachable sets: what an agent's mean can reach, and from where its goal can be met."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import goal_selector
from ppg_env.game.input_sets import pieces

WORST_CONDITION = 1e8
"""Beyond that the inverse of A is noise."""


def reach_upper(agent: Agent, directions: np.ndarray, horizon: int) -> np.ndarray:
    """(H+1, F) largest value of a . xbar_t over all controls, for ``directions`` (F, n)."""
    drift, result = agent.start, np.empty((horizon + 1, len(directions)))
    for t in range(horizon + 1):
        result[t] = directions @ drift
        drift = agent.A @ drift
    times, sums = np.arange(horizon + 1), _support_sums(agent, directions, agent.A, horizon)
    for (first, last), total in zip(_spans(agent, horizon), sums, strict=True):
        # A^l B at time t belongs to the control of step t - 1 - l.
        result += total[np.maximum(times - first, 0)] - total[np.maximum(times - last, 0)]
    return result


class BackwardReach:
    """Largest a . xbar_t over states from which the goal can be met, for ``directions`` (F, n).

    With k = T - t steps to go,  x_t = A^-k goal - sum_{l<k} A^-(l+1) B u_{t+l},  which needs an
    invertible A and a goal that fixes the whole state.
    """

    def __init__(self, agent: Agent, directions: np.ndarray, horizon: int) -> None:
        inverse, rows = np.linalg.inv(agent.A), np.array(directions)
        self._goal = np.empty((horizon + 1, len(directions)))
        for k in range(horizon + 1):
            self._goal[k] = rows @ agent.goal
            rows = rows @ inverse
        self._sums = _support_sums(agent, -directions @ inverse, inverse, horizon)
        self._spans = _spans(agent, horizon)

    @staticmethod
    def exists(agent: Agent) -> bool:
        """Whether there is one for the agent."""
        regular = np.linalg.cond(agent.A) <= WORST_CONDITION
        return bool(agent.goal.size == agent.state_dim and regular)

    def upper(self, arrival: int) -> np.ndarray:
        """(T+1, F) bounds at t = 0..T for plans that meet the goal at T = ``arrival``."""
        times = np.arange(arrival + 1)
        left = arrival - times
        result = self._goal[left]
        for (first, last), total in zip(self._spans, self._sums, strict=True):
            result = result + total[np.clip(last - times, 0, left)]
            result = result - total[np.clip(first - times, 0, left)]
        return result


def _support_sums(
    agent: Agent, directions: np.ndarray, turn: np.ndarray, count: int
) -> list[np.ndarray]:
    """For each control set, (count+1, F) sums of h(B' (turn^l)' a) over l < k, k = 0..``count``."""
    sums = [np.zeros((count + 1, len(directions))) for _ in pieces(agent.control)]
    rows = np.array(directions)
    for k in range(count):
        for total, (_, held) in zip(sums, pieces(agent.control), strict=True):
            total[k + 1] = total[k] + held.support(rows @ agent.B)
        rows = rows @ turn
    return sums


def _spans(agent: Agent, horizon: int) -> list[tuple[int, int]]:
    """First step of each control set, and of the one after it; both at most ``horizon``."""
    firsts = [min(first, horizon) for first, _ in pieces(agent.control)] + [horizon]
    return list(pairwise(firsts))


def plan_upper(agent: Agent, directions: np.ndarray, horizon: int) -> np.ndarray:
    """(H+1, F) bound on a . xbar_t over all plans that reach the goal by the horizon.

    The smaller of what can be reached from the start and what can still reach the goal.  The
    second half holds where an arrived agent could rest at its goal, so that the mean may be
    continued there: A goal = goal with 0 in every U_t, the whole state fixed, and A invertible.
    """
    forward = reach_upper(agent, directions, horizon)
    if not _can_rest_at_goal(agent):
        return forward
    return np.minimum(forward, BackwardReach(agent, directions, horizon).upper(horizon))


def _can_rest_at_goal(agent: Agent) -> bool:
    nothing = np.zeros(agent.control_dim)
    idle = all(held.clearance(nothing) <= 0 for _, held in pieces(agent.control))
    rests = BackwardReach.exists(agent) and np.array_equal(agent.A @ agent.goal, agent.goal)
    return bool(idle and rests)


def earliest_arrival(agent: Agent, limit: int) -> int | None:
    """First t <= ``limit`` at which the mean can be at the goal, ignoring everybody else.

    Supports along the axes rule most times out; a linear program decides the rest.
    None when the goal cannot be reached in time.
    """
    select = goal_selector(agent)
    slack = 1e-9 * max(1.0, float(np.abs(agent.goal).max()))
    upper = reach_upper(agent, select, limit)
    lower = -reach_upper(agent, -select, limit)
    possible = ((agent.goal <= upper + slack) & (agent.goal >= lower - slack)).all(axis=1)
    for t in np.flatnonzero(possible):
        if _reachable_at(agent, int(t)):
            return int(t)
    return None


def _reachable_at(agent: Agent, t: int) -> bool:
    select, power = goal_selector(agent), np.eye(agent.state_dim)
    if t == 0:
        return bool(np.array_equal(select @ agent.start, agent.goal))
    from scipy.optimize import linprog
    from scipy.sparse import block_diag

    blocks = []  # effect of u_{t-1}, ..., u_0 on the state at t
    for _ in range(t):
        blocks.append(power @ agent.B)
        power = power @ agent.A
    faces = [agent.control_at(k).faces for k in reversed(range(t))]
    answer = linprog(
        np.zeros(t * agent.control_dim),
        A_ub=block_diag([normals for normals, _ in faces]),
        b_ub=np.concatenate([offsets for _, offsets in faces]),
        A_eq=select @ np.hstack(blocks),
        b_eq=agent.goal - select @ power @ agent.start,
        bounds=(None, None),
        method="highs",
    )
    return answer.status == 0
