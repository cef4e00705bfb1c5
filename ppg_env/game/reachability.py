r"""Reachable sets: what an agent's mean can reach, and from where its goal can be met.

    max a.xbar_t = a.A^t x_0 + sum_{k<t} h_k(B' (A^{t-k-1})' a)

with h_k the support of U_k, the control set of step k less the reserve.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.canonical import canonical_agent
from ppg_env.game.dynamics import goal_selector
from ppg_env.game.input_sets import pieces, set_at
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


def earliest_arrival(agent: Agent, limit: int) -> int | None:
    """Return the first t <= ``limit`` at which the mean can be at the goal, other agents ignored.

    Supports along the axes exclude most times; a linear program decides the others, workspaces
    included.
    The result is None if the goal cannot be reached in time.
    """
    agent, _ = canonical_agent(agent)
    select = goal_selector(agent)
    slack = 1e-9 * max(1.0, float(np.abs(agent.goal).max()))
    upper = reach_upper(agent, select, limit)
    lower = -reach_upper(agent, -select, limit)
    possible = ((agent.goal <= upper + slack) & (agent.goal >= lower - slack)).all(axis=1)
    for t in np.flatnonzero(possible):
        if _reachable_at(agent, int(t), limit):
            return int(t)
    return None


def _reachable_at(agent: Agent, t: int, horizon: int) -> bool:
    """Return whether some controls bring the mean to the goal at ``t``, within its workspace."""
    select, n, m = goal_selector(agent), agent.state_dim, agent.control_dim
    if t == 0:
        return bool(np.array_equal(select @ agent.start, agent.goal))
    from scipy.optimize import linprog
    from scipy.sparse import block_diag, csr_array, vstack

    drift, effect = agent.start, np.zeros((n, t * m))  # xbar_k = drift + effect u
    rows, limits = workspace_rows(agent), workspace_limits(agent, horizon)
    inside: list[np.ndarray] = []
    room: list[np.ndarray] = []
    for k in range(t):
        drift, effect = agent.A @ drift, agent.A @ effect
        effect[:, k * m : (k + 1) * m] = agent.B
        if len(rows):
            inside.append(rows @ effect)
            room.append(limits[k + 1] - rows @ drift)
    control = planned_controls(agent, horizon)
    faces = [set_at(control, k).faces for k in range(t)]
    admissible = block_diag([normals for normals, _ in faces])
    solution = linprog(
        np.zeros(t * m),
        A_ub=vstack([admissible, csr_array(np.vstack(inside))]) if inside else admissible,
        b_ub=np.concatenate([*(offsets for _, offsets in faces), *room]),
        A_eq=select @ effect,
        b_eq=agent.goal - select @ drift,
        bounds=(None, None),
        method="highs",
    )
    return solution.status == 0
