r"""Linear dynamics of one agent: means, covariances, and what it can reach.

mean        xbar_{t+1}  = A xbar_t + B ubar_t
covariance  Sigma_{t+1} = (A - B K) Sigma_t (A - B K)' + noise,   Sigma_0 = sigma0
reach       max a.xbar_t = a.A^t x_0 + sum_k h_U(B' (A^{t-k-1})' a),   h_U the support of U
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ppg_env.game import Agent


def rollout(agent: Agent, controls: np.ndarray) -> np.ndarray:
    """(H+1, n) means of the nominal ``controls`` (H, m) from the agent's start."""
    means = np.empty((len(controls) + 1, agent.state_dim))
    means[0] = agent.start
    for t, control in enumerate(controls):
        means[t + 1] = agent.A @ means[t] + agent.B @ control
    return means


@lru_cache(maxsize=1024)
def covariances(agent: Agent, horizon: int) -> np.ndarray:
    """(H+1, n, n) covariances of the closed loop's state, read-only: no plan changes them."""
    loop = agent.closed_loop
    result = np.empty((horizon + 1, agent.state_dim, agent.state_dim))
    result[0] = agent.sigma0
    for t in range(horizon):
        result[t + 1] = loop @ result[t] @ loop.T + agent.noise
    result.setflags(write=False)
    return result


def square_root(covariance: np.ndarray) -> np.ndarray:
    """R with R R' = ``covariance``, which may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def reach_upper(agent: Agent, directions: np.ndarray, horizon: int) -> np.ndarray:
    """(H+1, F) largest value of a . xbar_t over all controls, for ``directions`` (F, n)."""
    drift, rows, total = agent.start, np.array(directions), np.zeros(len(directions))
    result = np.empty((horizon + 1, len(directions)))
    for t in range(horizon + 1):
        result[t] = directions @ drift + total
        total = total + agent.control.support(rows @ agent.B)
        drift, rows = agent.A @ drift, rows @ agent.A
    return result


def plan_upper(agent: Agent, directions: np.ndarray, horizon: int) -> np.ndarray:
    """(H+1, F) bound on a . xbar_t over all plans that reach the goal by the horizon.

    The smaller of what can be reached from the start and what can still reach the goal.  The
    second half holds where an arrived agent could rest at its goal, so that the mean may be
    continued there: A goal = goal with 0 in U, the whole state fixed, and A invertible.
    """
    forward = reach_upper(agent, directions, horizon)
    if not _can_rest_at_goal(agent):
        return forward
    backward, inverse = np.empty_like(forward), np.linalg.inv(agent.A)
    rows, total = np.array(directions) @ inverse, np.zeros(len(directions))
    for t in range(horizon, -1, -1):
        # k = H - t steps remain: x = A^-k (goal - sum_l A^l B u_l) and A^-k goal = goal.
        backward[t] = directions @ agent.goal + total
        total = total + agent.control.support(-rows @ agent.B)
        rows = rows @ inverse
    return np.minimum(forward, backward)


def _can_rest_at_goal(agent: Agent) -> bool:
    whole = agent.goal.size == agent.state_dim
    idle = agent.control.clearance(np.zeros(agent.control_dim)) <= 0
    regular = np.linalg.cond(agent.A) < 1e8  # beyond that the inverse is noise
    return bool(whole and idle and regular and np.array_equal(agent.A @ agent.goal, agent.goal))


def goal_selector(agent: Agent) -> np.ndarray:
    """(g, n) rows that pick from the state what the goal fixes: all of it, or its position."""
    return np.eye(agent.state_dim)[: agent.goal.size]


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
    answer = linprog(
        np.zeros(t * agent.control_dim),
        A_ub=block_diag([agent.control.normals] * t),
        b_ub=np.tile(agent.control.offsets, t),
        A_eq=select @ np.hstack(blocks),
        b_eq=agent.goal - select @ power @ agent.start,
        bounds=(None, None),
        method="highs",
    )
    return answer.status == 0
