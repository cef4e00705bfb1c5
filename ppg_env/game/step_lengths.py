r"""How far an agent's mean can move in each step, by simple bounds.

    a'(p_{t+1} - p_t) = a'C (A - I) xbar_t + a'C B ubar_t,     C selects the positions p

is bounded for each direction a by what reachable sets and workspaces allow for the first term, and
by the support of the control set for the second.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.input_sets import pieces, set_at
from ppg_env.game.reachability import plan_upper
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import workspace_limits, workspace_rows

MOST_DIRECTIONS = 64
"""Faces of control sets beyond this number are ignored; the bounds only widen."""


def step_directions(agent: Agent) -> np.ndarray:
    """Return unit directions (F, d): axes, diagonals, and the faces of sets of velocities."""
    d = agent.dim
    signs = np.array([s for s in product((-1.0, 0.0, 1.0), repeat=d) if any(s)])
    rows = [signs / np.linalg.norm(signs, axis=1)[:, None]]
    if agent.control_dim == d and np.array_equal(agent.B[:d], np.eye(d)):
        rows += [admissible.normals for _, admissible in pieces(agent.control)]
    return np.unique(np.concatenate(rows)[:MOST_DIRECTIONS], axis=0)


def step_lengths(agent: Agent, directions: np.ndarray, horizon: int) -> np.ndarray:
    """Return bounds (H, F) on a'(p_{t+1} - p_t) for ``directions``, over plans that arrive.

    They are never negative, so that the sets they describe contain the straight way there.
    """
    d, control = agent.dim, planned_controls(agent, horizon)
    rows = directions @ (agent.A - np.eye(agent.state_dim))[:d]
    drift = np.zeros((horizon, len(rows)))
    if rows.any():
        inside = [workspace_support(agent, row, horizon) for row in rows]
        drift = np.minimum(plan_upper(agent, rows, horizon)[:horizon], inside)
    push = directions @ agent.B[:d]
    pushes = {id(admissible): admissible.support(push) for _, admissible in pieces(control)}
    total = drift + [pushes[id(set_at(control, t))] for t in range(horizon)]
    slack = tol.CONTROL * (1 + np.abs(push).sum(axis=1))
    return np.maximum(total, 0.0) + slack


def position_box(agent: Agent, horizon: int) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds (d,) on all positions of plans that arrive by the horizon."""
    axes = np.eye(agent.state_dim)[: agent.dim]
    rows = np.vstack([axes, -axes])
    most = plan_upper(agent, rows, horizon).max(axis=0)
    most = np.minimum(most, [workspace_support(agent, row, horizon) for row in rows])
    return -most[agent.dim :], most[: agent.dim]


def workspace_support(agent: Agent, row: np.ndarray, horizon: int) -> float:
    """Return the largest ``row`` . xbar in the workspace, at any time; infinite without bound."""
    if not agent.within:
        return float("inf")
    return _workspace_support(agent, tuple(row.tolist()), horizon)


@lru_cache(maxsize=1024)
def _workspace_support(agent: Agent, row: tuple[float, ...], horizon: int) -> float:
    from scipy.optimize import linprog

    limits = workspace_limits(agent, horizon).max(axis=0) + tol.LENGTH
    solution = linprog(
        -np.array(row), A_ub=workspace_rows(agent), b_ub=limits, bounds=(None, None), method="highs"
    )
    return float(-solution.fun) if solution.status == 0 else float("inf")
