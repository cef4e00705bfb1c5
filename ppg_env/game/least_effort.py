"""Plans and laws of least effort: an agent that heads for its goal as if alone."""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import require
from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import goal_selector
from ppg_env.game.input_sets import excess, room
from ppg_env.game.plan import Plan, make_plan


def straight_plan(agent: Agent, horizon: int) -> Plan | None:
    """The plan that heads for the goal as if alone: least effort, in the fewest steps it admits.

    With A = B = I that is the straight line at constant speed.  Least effort is the
    minimum-norm solution of the reachability equation; a time is admitted when those controls
    lie in their sets, or those of least sum of u_t' u_t / room_t, which bear what the first leave
    room for: where speed sets change, the straight line is flown as fast as they let.  None when
    no time up to ``horizon`` is admitted.
    """
    select, power, blocks = goal_selector(agent), np.eye(agent.state_dim), []
    controls = np.zeros((horizon, agent.control_dim))
    if make_plan(agent, controls).arrival == 0:
        return make_plan(agent, controls)
    for t in range(1, horizon + 1):
        blocks.append(power @ agent.B)
        power = power @ agent.A
        effect = select @ np.hstack(blocks[::-1])
        wanted = agent.goal - select @ power @ agent.start
        steps = _least_effort(effect, wanted, np.ones(t))
        left = room(agent.control, steps)
        if left.min() < 1 < left.max():  # some bear too much, and others could bear more
            steps = _least_effort(effect, wanted, np.sqrt(left))
        reached = np.abs(effect @ steps.ravel() - wanted).max() <= tol.LENGTH
        if reached and excess(agent.control, steps) <= tol.CONTROL:
            controls[:t] = steps
            return make_plan(agent, controls)
    return None


def _least_effort(effect: np.ndarray, wanted: np.ndarray, bearing: np.ndarray) -> np.ndarray:
    """(t, m) controls with ``effect`` u = ``wanted`` and the least sum of |u_k / bearing_k|^2."""
    share = np.repeat(bearing, effect.shape[1] // len(bearing))
    effort = share * np.linalg.lstsq(effect * share, wanted, rcond=None)[0]
    return effort.reshape(len(bearing), -1)


def least_effort_laws(agent: Agent, horizon: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """For k = 1..``horizon`` steps to go: (F, f) with first control F x + f of least total effort.

    Step counts from which the goal cannot be hit (more goal components than inputs so far) are
    left out.
    """
    select, power = goal_selector(agent), np.eye(agent.state_dim)
    blocks: list[np.ndarray] = []
    laws: list[tuple[np.ndarray, np.ndarray]] = []
    for _ in range(horizon):
        blocks.insert(0, power @ agent.B)
        power = power @ agent.A
        effect = select @ np.hstack(blocks)
        if np.linalg.matrix_rank(effect) < len(select):
            continue
        first = np.linalg.pinv(effect)[: agent.control_dim]
        laws.append((-first @ select @ power, first @ agent.goal))
    require(bool(laws), "goal", "cannot be controlled", "check A and B")
    return laws
