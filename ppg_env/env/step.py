"""The outcome of a step of the simulator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Step:
    """The outcome of a step for C copies, N agents, E encounters; the next step reuses the arrays.

    Attributes
    ----------
    observation : (C, N, W) float32, see :mod:`ppg_env.env.observation`; the first one of the new
        episode where ``over``.
    reward : (C, N); zero for agents whose episode ended earlier.
    terminated, truncated : (C, N) whether the agent's episode ended in this step, and how.
    over : (C,) whether the copy's episode ended and it was restarted.
    final_observation : (C, N, W) the last observation of an episode; valid where ``over``.
    acting : (C, N) whether the agent was alive before the step.
    arrived, crashed : (C, N) events of this step.
    overlap : (C, E) encounters that overlap, in the order of ``game.encounters``.
    time_cost, safety_cost : (C, N) terms of the agent's own cost in this step; the first
        includes the cost of effort.
    """

    observation: np.ndarray
    reward: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    over: np.ndarray
    final_observation: np.ndarray
    acting: np.ndarray
    arrived: np.ndarray
    crashed: np.ndarray
    overlap: np.ndarray
    time_cost: np.ndarray
    safety_cost: np.ndarray


def make_step(C: int, N: int, E: int, W: int) -> Step:
    """Return the arrays of a step, all zero."""
    flags = [np.zeros((C, N), dtype=np.bool_) for _ in range(5)]
    costs = [np.zeros((C, N)) for _ in range(3)]
    observations = [np.zeros((C, N, W), dtype=np.float32) for _ in range(2)]
    return Step(
        observation=observations[0],
        reward=costs[0],
        terminated=flags[0],
        truncated=flags[1],
        over=np.zeros(C, dtype=np.bool_),
        final_observation=observations[1],
        acting=flags[2],
        arrived=flags[3],
        crashed=flags[4],
        overlap=np.zeros((C, E), dtype=np.bool_),
        time_cost=costs[1],
        safety_cost=costs[2],
    )
