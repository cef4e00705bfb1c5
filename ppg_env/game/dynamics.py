r"""Linear dynamics of one agent: means and covariances.

mean        xbar_{t+1}  = A xbar_t + B ubar_t
covariance  Sigma_{t+1} = (A - B K) Sigma_t (A - B K)' + noise,   Sigma_0 = sigma0
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.game.agent import Agent


def rollout(agent: Agent, controls: np.ndarray) -> np.ndarray:
    """Return the means (H+1, n) under the nominal ``controls`` (H, m) from the agent's start."""
    means = np.empty((len(controls) + 1, agent.state_dim))
    means[0] = agent.start
    for t, control in enumerate(controls):
        means[t + 1] = agent.A @ means[t] + agent.B @ control
    return means


@lru_cache(maxsize=1024)
def covariances(agent: Agent, horizon: int) -> np.ndarray:
    """Return the covariances (H+1, n, n) of the closed loop's state, read-only.

    No plan changes them.

    Raises
    ------
    InputError
        If a standard deviation exceeds ``tol.GROWTH`` within the horizon.
    """
    matrices = agent.closed_loop, agent.sigma0, agent.noise
    result = _covariances(agent.state_dim, horizon, *(matrix.tobytes() for matrix in matrices))
    require(
        bool((np.abs(result) <= tol.GROWTH**2).all()),
        "gain",
        f"lets position errors grow beyond {tol.GROWTH:g} within {horizon} steps",
        "choose one for which A - B gain shrinks errors, or a shorter horizon",
    )
    return result


@lru_cache(maxsize=256)
def _covariances(n: int, horizon: int, *matrices: bytes) -> np.ndarray:
    """Return the covariances for the bytes of A - B K, sigma0 and noise; equal agents share."""
    loop, first, noise = (np.frombuffer(matrix).reshape(n, n) for matrix in matrices)
    result = np.empty((horizon + 1, n, n))
    result[0] = first
    with np.errstate(over="ignore", invalid="ignore"):
        for t in range(horizon):
            result[t + 1] = loop @ result[t] @ loop.T + noise
    result.setflags(write=False)
    return result


def check_growth(agent: Agent, horizon: int) -> None:
    """Refuse an agent whose states or errors outgrow double arithmetic within the horizon.

    Raises
    ------
    InputError
        If an entry of A^t, t <= ``horizon``, or a standard deviation exceeds ``tol.GROWTH``.
    """
    power = np.eye(agent.state_dim)
    for t in range(0 if np.array_equal(agent.A, power) else horizon):
        power = power @ agent.A
        if not (np.abs(power) <= tol.GROWTH).all():
            raise InputError(
                "A",
                f"has powers beyond {tol.GROWTH:g} within {t + 1} of {horizon} steps",
                "choose one that lets states grow less, or a shorter horizon",
            )
    covariances(agent, horizon)


def square_root(covariance: np.ndarray) -> np.ndarray:
    """Return R with R R' = ``covariance``, which may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def goal_selector(agent: Agent) -> np.ndarray:
    """Return the rows (g, n) that select the state components fixed by the goal."""
    return np.eye(agent.state_dim)[: agent.goal.size]
