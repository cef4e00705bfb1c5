"""Plans and control laws of least effort, for an agent that ignores all others."""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import require
from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import check_growth, goal_selector
from ppg_env.game.input_sets import excess, room
from ppg_env.game.plan import Plan, make_plan


def straight_plan(agent: Agent, horizon: int) -> Plan | None:
    """Return the plan of least effort to the goal, in the fewest steps, other agents ignored.

    With A = B = I it is the straight line at constant speed.  Least effort is the minimum-norm
    solution of the reachability equation.  A number of steps is accepted if these controls lie in
    their sets, or if those of the least sum of u_t' u_t / room_t do, which use the larger sets
    more: where speed sets change, the straight line is followed as fast as they permit.  The
    result is None if no number of steps up to ``horizon`` is accepted.

    Raises
    ------
    InputError
        If states or errors outgrow double arithmetic within the horizon.
    """
    check_growth(agent, horizon)
    select, power, blocks = goal_selector(agent), np.eye(agent.state_dim), []
    controls = np.zeros((horizon, agent.control_dim))
    if make_plan(agent, controls).arrival == 0:
        return make_plan(agent, controls)
    for t in range(1, horizon + 1):
        blocks.append(power @ agent.B)
        power = power @ agent.A
        effect = select @ np.hstack(blocks[::-1])
        change = agent.goal - select @ power @ agent.start
        steps = _least_effort(effect, change, np.ones(t))
        if not (np.abs(steps) <= tol.LARGEST).all():  # no control set is that large
            continue
        left = room(agent.control, steps)
        if left.min() < 1 < left.max():  # some controls leave their sets, others have room
            steps = _least_effort(effect, change, np.sqrt(left))
        if excess(agent.control, steps) > tol.CONTROL:
            continue
        if np.abs(effect @ steps.ravel() - change).max() <= tol.LENGTH:
            controls[:t] = steps
            return make_plan(agent, controls)
    return None


def _least_effort(effect: np.ndarray, change: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return controls (t, m) with ``effect`` u = ``change`` and least sum of |u_k / shares_k|^2."""
    weights = np.repeat(shares, effect.shape[1] // len(shares))
    effort = weights * np.linalg.lstsq(effect * weights, change, rcond=None)[0]
    return effort.reshape(len(shares), -1)


def least_effort_laws(agent: Agent, horizon: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return (F, f) for k = 1..``horizon`` steps to go: the first control of least effort, F x + f.

    Numbers of steps from which the goal cannot be reached (more goal components than inputs so
    far) are omitted.

    Raises
    ------
    InputError
        If no number of steps reaches the goal.
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
    require(bool(laws), "goal", "cannot be reached by any control", "check A and B")
    return laws
