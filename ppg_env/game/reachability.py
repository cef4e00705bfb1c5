r"""Reachable sets: what an agent's mean can reach, and from where its goal can be met.

    max a.xbar_t = a.A^t x_0 + sum_{k<t} h_k(B' (A^{t-k-1})' a)

with h_k the support of U_k, the control set of step k less the reserve.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError
from ppg_env.game.agent import Agent
from ppg_env.game.canonical import canonical_agent
from ppg_env.game.dynamics import goal_selector
from ppg_env.game.input_sets import pieces
from ppg_env.game.plan_constraints import plan_constraints, some_controls
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import workspace_limits, workspace_rows

WORST_CONDITION = 1e8
"""Condition number of A beyond which its inverse is numerical noise."""


def reach_upper(agent: Agent, directions: np.ndarray, horizon: int) -> np.ndarray:
    """Return the largest a . xbar_t (H+1, F) over all controls, for ``directions`` (F, n)."""
    drift, result = agent.start, np.empty((horizon + 1, len(directions)))
    for t in range(horizon + 1):
        result[t] = directions @ drift
        drift = agent.A @ drift
    times = np.arange(horizon + 1)
    sums = _support_sums(agent, directions, agent.A, horizon, horizon)
    for (first, last), total in zip(_spans(agent, horizon), sums, strict=True):
        # A^l B at time t belongs to the control of step t - 1 - l.
        result += total[np.maximum(times - first, 0)] - total[np.maximum(times - last, 0)]
    return result


class BackwardReach:
    """Largest a . xbar_t over states from which the goal can be met, for ``directions`` (F, n).

    With k = T - t steps to go,  x_t = A^-k goal - sum_{l<k} A^-(l+1) B u_{t+l},  which needs an
    invertible A and a goal that fixes the whole state.  The bound is infinite where the powers of
    the inverse exceed ``tol.LARGEST``.
    """

    def __init__(self, agent: Agent, directions: np.ndarray, horizon: int) -> None:
        inverse, rows = np.linalg.inv(agent.A), np.array(directions)
        self._goal = np.full((horizon + 1, len(directions)), np.inf)
        self._last = 0
        for k in range(horizon + 1):
            if np.abs(rows).max() > tol.LARGEST:
                break
            self._last, self._goal[k] = k, rows @ agent.goal
            rows = rows @ inverse
        self._sums = _support_sums(agent, -directions @ inverse, inverse, self._last, horizon)
        self._spans = _spans(agent, horizon)

    @staticmethod
    def exists(agent: Agent) -> bool:
        """Return whether A is invertible and the goal fixes the whole state."""
        regular = np.linalg.cond(agent.A) <= WORST_CONDITION
        return bool(agent.goal.size == agent.state_dim and regular)

    def upper(self, arrival: int) -> np.ndarray:
        """Return bounds (T+1, F) at t = 0..T for plans that meet the goal at T = ``arrival``."""
        times = np.arange(arrival + 1)
        left = arrival - times
        result, left = self._goal[left], np.minimum(left, self._last)
        for (first, last), total in zip(self._spans, self._sums, strict=True):
            result = result + total[np.clip(last - times, 0, left)]
            result = result - total[np.clip(first - times, 0, left)]
        return result


def _support_sums(
    agent: Agent, directions: np.ndarray, turn: np.ndarray, count: int, horizon: int
) -> list[np.ndarray]:
    """Return, per control set, sums (count+1, F) of h(B' (turn^l)' a), l < k, k = 0..``count``."""
    sets = pieces(planned_controls(agent, horizon))
    sums = [np.zeros((count + 1, len(directions))) for _ in sets]
    rows = np.array(directions)
    for k in range(count):
        for total, (_, admissible) in zip(sums, sets, strict=True):
            total[k + 1] = total[k] + admissible.support(rows @ agent.B)
        rows = rows @ turn
    return sums


def _spans(agent: Agent, horizon: int) -> list[tuple[int, int]]:
    """Return the first step of each control set and of the next one, at most ``horizon``."""
    sets = pieces(planned_controls(agent, horizon))
    firsts = [min(first, horizon) for first, _ in sets] + [horizon]
    return list(pairwise(firsts))


def plan_upper(agent: Agent, directions: np.ndarray, horizon: int) -> np.ndarray:
    """Return a bound (H+1, F) on a . xbar_t over all plans that reach the goal by the horizon.

    The bound is the smaller of the forward bound from the start and the backward bound from the
    goal.  The backward bound applies where an arrived agent can rest at its goal: A goal = goal
    with 0 in every U_t, the whole state fixed, and A invertible.
    """
    forward = reach_upper(agent, directions, horizon)
    if not _can_rest_at_goal(agent, horizon):
        return forward
    return np.minimum(forward, BackwardReach(agent, directions, horizon).upper(horizon))


def _can_rest_at_goal(agent: Agent, horizon: int) -> bool:
    zero, sets = np.zeros(agent.control_dim), pieces(planned_controls(agent, horizon))
    idle = all(admissible.clearance(zero) <= 0 for _, admissible in sets)
    rests = BackwardReach.exists(agent) and np.array_equal(agent.A @ agent.goal, agent.goal)
    return bool(idle and rests)


def possible_arrivals(agent: Agent, limit: int, directions: np.ndarray) -> np.ndarray:
    """Return (limit+1,) whether supports allow the mean to be at the goal at each time.

    ``directions`` (F, n) do not depend on components that the goal leaves free.
    """
    goal = directions[:, : agent.goal.size] @ agent.goal
    slack = 1e-9 * max(1.0, float(np.abs(agent.goal).max()))
    upper = reach_upper(agent, directions, limit)
    lower = -reach_upper(agent, -directions, limit)
    return ((goal <= upper + slack) & (goal >= lower - slack)).all(axis=1)


def earliest_arrival(agent: Agent, limit: int) -> int | None:
    """Return the first t <= ``limit`` at which the mean can be at the goal, other agents ignored.

    Supports along the axes exclude most times; linear programs decide the others, workspaces
    included.
    The result is None if the goal cannot be reached in time.
    """
    agent, _ = canonical_agent(agent)
    possible = possible_arrivals(agent, limit, goal_selector(agent))
    return first_reachable(agent, np.flatnonzero(possible).tolist(), limit)


def sufficient_horizon(agent: Agent, most: int) -> int | None:
    """Return the earliest arrival up to ``most``, a horizon for which sets may be undefined."""
    try:
        return earliest_arrival(agent, most)
    except InputError:  # errors outgrow double arithmetic, or the reserve leaves no control
        return None


def first_reachable(agent: Agent, times: list[int], horizon: int) -> int | None:
    """Return the first of ``times`` at which the goal can be reached, or None.

    ``times`` are increasing; where an arrived agent can wait at its goal, they are bisected.
    """
    if not _can_wait_at_goal(agent, horizon):
        return next((t for t in times if _reachable_at(agent, t, horizon)), None)
    missed, stride = -1, 1  # times[missed] is too early
    while missed < len(times) - 1:
        k = min(missed + stride, len(times) - 1)
        if _reachable_at(agent, times[k], horizon):
            break
        missed, stride = k, 2 * stride
    else:
        return None
    while k - missed > 1:
        middle = (missed + k) // 2
        if _reachable_at(agent, times[middle], horizon):
            k = middle
        else:
            missed = middle
    return times[k]


def _can_wait_at_goal(agent: Agent, horizon: int) -> bool:
    if not _can_rest_at_goal(agent, horizon):
        return False
    inside = workspace_rows(agent) @ agent.goal <= workspace_limits(agent, horizon)
    return bool(inside.all())


def _reachable_at(agent: Agent, t: int, horizon: int) -> bool:
    """Return whether some controls bring the mean to the goal at ``t``, within its workspace."""
    if t == 0:
        return bool(np.array_equal(goal_selector(agent) @ agent.start, agent.goal))
    return some_controls(plan_constraints(agent, t, horizon)) is not None
