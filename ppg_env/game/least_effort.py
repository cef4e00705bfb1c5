"""Plans and control laws of least effort, for an agent that ignores all others."""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.canonical import canonical_agent
from ppg_env.game.dynamics import check_growth, goal_selector
from ppg_env.game.input_sets import Controls, excess, room
from ppg_env.game.plan import Plan, make_plan
from ppg_env.game.plan_constraints import least_norm_controls, plan_constraints, some_controls
from ppg_env.game.reachability import first_reachable, possible_arrivals
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import workspace_excess

SLACK = 1e-9
"""Room that the program of least effort adds to each limit, a hundredth of ``tol.CONTROL``."""


def straight_plan(agent: Agent, horizon: int) -> Plan | None:
    """Return the plan of least effort to the goal, in the fewest steps, other agents ignored.

    With A = B = I it is the straight line at constant speed.  Controls are in their sets less the
    reserve, means in the workspace.  The plan is the minimum-norm solution of the reachability
    equation where that is admissible.  Where speed sets change, the solution of the least sum of
    u_t' u_t / room_t is next, which uses the larger sets more and follows the straight line.
    Otherwise linear programs find the fewest steps, and a quadratic program the least effort in
    them.  The result is None if there is no plan up to ``horizon``.

    Raises
    ------
    InputError
        If states or errors outgrow double arithmetic within the horizon, or the reserve leaves no
        control.
    """
    check_growth(agent, horizon)
    own, unit = canonical_agent(agent)
    plan = _straight(own, horizon)
    if own is agent or plan is None:
        return plan
    return make_plan(agent, plan.controls * unit)


def _straight(agent: Agent, horizon: int) -> Plan | None:
    """Return :func:`straight_plan` of an agent in its own units."""
    select, power, blocks = goal_selector(agent), np.eye(agent.state_dim), []
    idle = make_plan(agent, np.zeros((horizon, agent.control_dim)))
    if idle.arrival == 0:
        return idle
    sets, possible, fastest = planned_controls(agent, horizon), _possible(agent, horizon), None
    for t in range(1, horizon + 1):
        blocks.append(power @ agent.B)
        power = power @ agent.A
        effect = select @ np.hstack(blocks[::-1])
        change = agent.goal - select @ power @ agent.start
        steps = _weighted_norm(effect, change, np.ones(t))
        plan = _admissible(agent, sets, steps, horizon)
        if plan is None and isinstance(agent.control, tuple):
            shares = np.sqrt(room(sets, steps.clip(-tol.LARGEST, tol.LARGEST)))
            if shares.min() < 1 < shares.max():  # some leave their sets, others have room
                weighted = _weighted_norm(effect, change, shares)
                plan = _admissible(agent, sets, weighted, horizon)
        if plan is None and possible[t]:
            if fastest is None or fastest < t:
                later = np.flatnonzero(possible[t:]) + t
                fastest = first_reachable(agent, later.tolist(), horizon) or horizon + 1
            plan = _program(agent, sets, t, horizon) if t == fastest else None
        if plan is not None:
            return plan
    return None


def _possible(agent: Agent, horizon: int) -> np.ndarray:
    """Return (H+1,) whether supports along axes, and along the faces of controls, allow arrival."""
    select, normals = goal_selector(agent), agent.control_at(0).normals
    if normals.shape[1] == len(select):  # exact for point masses
        select = np.concatenate([select, normals @ select])
    return possible_arrivals(agent, horizon, select)


def _weighted_norm(effect: np.ndarray, change: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return controls (t, m) with ``effect`` u = ``change`` and least sum of |u_k / shares_k|^2."""
    weights = np.repeat(shares, effect.shape[1] // len(shares))
    effort = weights * np.linalg.lstsq(effect * weights, change, rcond=None)[0]
    return effort.reshape(len(shares), -1)


def _program(agent: Agent, sets: Controls, arrival: int, horizon: int) -> Plan | None:
    """Return the plan of least effort that arrives at ``arrival``; None if there is no plan."""
    constraints = plan_constraints(agent, arrival, horizon)
    fallback = some_controls(constraints)
    if fallback is None:
        return None
    for controls in (least_norm_controls(constraints, SLACK), fallback):
        if controls is not None:
            plan = _admissible(agent, sets, controls.reshape(arrival, -1), horizon)
            if plan is not None:
                return plan
    return None


def _admissible(agent: Agent, sets: Controls, steps: np.ndarray, horizon: int) -> Plan | None:
    """Return the plan of controls ``steps`` (t, m) if it arrives at t, within all limits."""
    if not (np.abs(steps) <= tol.LARGEST).all() or excess(sets, steps) > tol.CONTROL:
        return None
    controls = np.zeros((horizon, agent.control_dim))
    controls[: len(steps)] = steps
    plan = make_plan(agent, controls)
    if plan.arrival is None or workspace_excess(agent, plan.means) > tol.LENGTH:
        return None
    return plan
