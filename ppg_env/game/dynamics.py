r"""Linear dynamics of one agent: means, covariances, and what it can reach.

mean        xbar_{t+1}  = A xbar_t + B ubar_t
covariance  Sigma_{t+1} = (A - B K) Sigma_t (A - B K)' + noise,   Sigma_0 = sigma0
reach       max a.xbar_t = a.A^t x_0 + sum_{k<t} h_k(B' (A^{t-k-1})' a),
            h_k the support of U_k, the control set of step k
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ppg_env.errors import require
from ppg_env.game.agent import Agent

LARGEST = 1e100
"""Covariances beyond that have nothing to do with any plan, and their squares overflow."""


def rollout(agent: Agent, controls: np.ndarray) -> np.ndarray:
    """(H+1, n) means of the nominal ``controls`` (H, m) from the agent's start."""
    means = np.empty((len(controls) + 1, agent.state_dim))
    means[0] = agent.start
    for t, control in enumerate(controls):
        means[t + 1] = agent.A @ means[t] + agent.B @ control
    return means


@lru_cache(maxsize=1024)
def covariances(agent: Agent, horizon: int) -> np.ndarray:
    """(H+1, n, n) covariances of the closed loop's state, read-only: no plan changes them.

    Raises
    ------
    InputError
        If they grow beyond all numbers within the horizon.
    """
    loop = agent.closed_loop
    result = np.empty((horizon + 1, agent.state_dim, agent.state_dim))
    result[0] = agent.sigma0
    with np.errstate(over="ignore", invalid="ignore"):
        for t in range(horizon):
            result[t + 1] = loop @ result[t] @ loop.T + agent.noise
    require(
        bool((np.abs(result) < LARGEST).all()),
        "gain",
        f"lets position errors grow beyond all numbers within {horizon} steps",
        "choose one for which A - B gain shrinks errors, or a shorter horizon",
    )
    result.setflags(write=False)
    return result


def square_root(covariance: np.ndarray) -> np.ndarray:
    """R with R R' = ``covariance``, which may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def goal_selector(agent: Agent) -> np.ndarray:
    """(g, n) rows that pick from the state what the goal fixes: all of it, or its position."""
    return np.eye(agent.state_dim)[: agent.goal.size]
