"""Covariances of an agent's errors, some steps after its state was observed."""

from __future__ import annotations

import numpy as np

from ppg_env.game.agent import Agent


def errors_ahead(agent: Agent, steps: np.ndarray) -> np.ndarray:
    """Return (K, n, n) covariances after each of ``steps`` (K,), from a known state.

    Feedback is left out.
    """
    growing = np.zeros((max(steps.max(initial=0), 0) + 1, agent.state_dim, agent.state_dim))
    for t in range(len(growing) - 1):
        growing[t + 1] = agent.A @ growing[t] @ agent.A.T + agent.noise
    return growing[steps]
