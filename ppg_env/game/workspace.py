r"""Where an agent's mean has to stay: a workspace, speed limits, or both.

    a' xbar_t + z sigma_a(t) <= b,     sigma_a(t)^2 = a' Sigma(t) a,     t = 0..T

for every face (a, b) of the set, with z = ``sigmas``: the mean stays z standard deviations clear.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import covariances


def workspace_rows(agent: Agent) -> np.ndarray:
    """Return (R, n) the unit normals of all faces of ``agent.within``, in the state space."""
    rows = [np.zeros((0, agent.state_dim))]
    for region in agent.within:
        padding = np.zeros((len(region.normals), agent.state_dim - region.dim))
        rows.append(np.hstack([region.normals, padding]))
    return np.concatenate(rows)


@lru_cache(maxsize=1024)
def workspace_limits(agent: Agent, horizon: int) -> np.ndarray:
    """Return (H+1, R) the largest a' xbar_t for the rows of :func:`workspace_rows`, read-only."""
    rows, spread = workspace_rows(agent), covariances(agent, horizon)
    deviations = np.sqrt(np.maximum(np.einsum("ri,tij,rj->tr", rows, spread, rows), 0.0))
    regions = agent.within
    offsets = np.concatenate([np.zeros(0), *(region.offsets for region in regions)])
    sigmas = np.repeat([w.sigmas for w in regions], [len(w.offsets) for w in regions])
    limits = offsets - sigmas * deviations
    limits.setflags(write=False)
    return limits


def workspace_excess(agent: Agent, means: np.ndarray) -> float:
    """Return the largest a' xbar_t - limit over ``means`` (t, n) from time 0; -inf if unbounded.

    It is a length: velocities count by the positions that they change in a step.
    """
    rows = workspace_rows(agent)
    if not len(rows):
        return -np.inf
    limits = workspace_limits(agent, len(means) - 1)
    return float(((means @ rows.T - limits) / lengths_per_unit(agent, rows)).max())


def lengths_per_unit(agent: Agent, rows: np.ndarray) -> np.ndarray:
    """Return (R,) by what a value of ``rows`` (R, n) . x is divided to be a length."""
    return np.asarray(
        np.linalg.norm(rows * agent.state_units[: rows.shape[1]], axis=1) / agent.unit
    )
