"""Violations of the constraints of a profile, recomputed from the game and the controls."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import goal_selector, rollout
from ppg_env.game.game import Game
from ppg_env.game.input_sets import excess
from ppg_env.game.plan import Plan, Profile
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import workspace_excess


@dataclass(frozen=True)
class Residuals:
    """Violations of the constraints, never negative.

    Attributes
    ----------
    control : (N,) largest distance of a control beyond a face of its step's U, less the reserve.
    within : (N,) largest distance of a mean beyond a face of its workspace, sigmas included.
    goal : (N,) largest component by which the mean misses the goal, at arrival or at the end.
    overlap : (E,) largest penetration of the means in traffic; of the best face during a step.
    """

    control: np.ndarray
    within: np.ndarray
    goal: np.ndarray
    overlap: np.ndarray


def residuals(game: Game, profile: Profile, overlap: np.ndarray) -> Residuals:
    """Return the violations of all constraints, for overlaps (E,) that are known."""
    rows = [
        _plan_residuals(agent, plan, game.horizon)
        for agent, plan in zip(game.agents, profile, strict=True)
    ]
    control, within, goal = np.array(rows).T
    return Residuals(control, within, goal, overlap)


@lru_cache(maxsize=4096)
def _plan_residuals(agent: Agent, plan: Plan, horizon: int) -> tuple[float, float, float]:
    """Return the violations of controls, workspace and goal by one plan."""
    end = horizon if plan.arrival is None else plan.arrival
    control = excess(planned_controls(agent, horizon), plan.controls[:end])
    within = workspace_excess(agent, plan.means[: end + 1])
    mean = rollout(agent, plan.controls[:end])[-1]
    goal = float(np.abs(goal_selector(agent) @ mean - agent.goal).max())
    return max(0.0, control), max(0.0, within), goal
