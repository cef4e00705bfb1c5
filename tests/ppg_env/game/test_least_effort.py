"""Straight flight over any control set: fewest steps by linear programs, then least effort."""

from __future__ import annotations

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest

from ppg_env import Agent, Game, InputError, Polytope, evaluate, make_game, straight_plan
from ppg_env.game.effort_laws import least_effort_laws
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.input_sets import excess, set_at
from ppg_env.game.reachability import earliest_arrival, sufficient_horizon
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import workspace_limits, workspace_rows
from solvers import best_response
from tests.ppg_env.strategies import double_integrator

BODY = Polytope.box([1.0, 1.0])
THRUSTERS = np.array([[0, 0, 0], [0, 0, 0], [1, -0.5, -0.5], [0, 0.866, -0.866]])
A4, B4 = double_integrator(2)
UNIT_CUBE = Polytope.from_halfspaces(
    np.concatenate([-np.eye(3), np.eye(3)]), [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
)


def point(goal: object, control: object, **fields: object) -> Agent:
    return Agent([0.0, 0.0], goal, BODY, control, gain=0.5, noise=0.01, **fields)


def accelerated(goal: object, control: object, **fields: object) -> Agent:
    values = {"B": B4, "gain": np.hstack([0.1 * np.eye(2), 0.5 * np.eye(2)])} | fields
    noise = np.diag([0.0, 0.0, 0.01, 0.01])
    return Agent([0.0, 0.0, 0.0, 0.0], goal, BODY, control, A=A4, noise=noise, **values)


SPEED = HalfSpaces.between([-1e3, -1e3, -1.0, -1.0], [1e3, 1e3, 1.0, 1.0], 2.0)
AGENTS = {
    "one-sided thrusters": accelerated(
        [10.0, 4.0, 0.0, 0.0], UNIT_CUBE, B=THRUSTERS, gain=np.zeros((3, 4))
    ),
    "a triangle next to zero": point(
        [20.0, 9.0], Polytope.from_vertices([[1, 0], [3, 0], [3, 2]])
    ),
    "zero on the edge": accelerated(
        [10.0, 1.0, 0.0, 0.0], Polytope.from_vertices([[0, -2], [-3, 1], [2, 1], [2, -1]])
    ),
    "one axis of width zero": point([40.0, 0.0], Polytope.box([20.0, 0.0])),
    "a segment": point([30.0, 15.0], Polytope.from_vertices([[2, 1], [8, 4]])),
    "a single point": point([30.0, 15.0], Polytope.from_vertices([[2, 1]])),
    "a segment of accelerations": accelerated(
        [6.0, 3.0, 0.0, 0.0],
        Polytope.from_halfspaces([[1, -2], [-1, 2], [1, 0], [-1, 0]], [0, 0, 1, 1]),
    ),
    "speed limits": accelerated([20.0, 3.0, 0.0, 0.0], Polytope.box([2.0, 2.0]), within=SPEED),
    "reserve": accelerated([10.0, 3.0, 0.0, 0.0], Polytope.disc(1.0), reserve=2.0),
    "a position only": accelerated([10.0, 3.0], Polytope.l1(1.0)),
    "sets that change": point(
        [20.0, 9.0], ((0, Polytope.box([10.0, 2.0])), (3, Polytope.l1(4.0)))
    ),
}  # fmt: skip


def least_effort(agent: Agent, arrival: int, horizon: int) -> float | None:
    """The least sum of squares by cvxpy, step by step; None if there is no plan."""
    state, u = agent.start, cp.Variable((arrival, agent.control_dim))
    sets, limits = planned_controls(agent, horizon), workspace_limits(agent, horizon)
    constraints = []
    for t in range(arrival):
        held = set_at(sets, t)
        constraints.append(held.normals @ u[t] <= held.offsets + 1e-9)
        state = agent.A @ state + agent.B @ u[t]
        if len(workspace_rows(agent)):
            constraints.append(workspace_rows(agent) @ state <= limits[t + 1] + 1e-9)
    constraints.append(state[: agent.goal.size] == agent.goal)
    program = cp.Problem(cp.Minimize(cp.sum_squares(u)), constraints)
    program.solve(solver="CLARABEL")
    return float(program.value) if program.status == "optimal" else None


@pytest.mark.parametrize("name", AGENTS)
def test_straight_flight_takes_the_fewest_steps_and_the_least_effort_over_the_set(
    name: str,
) -> None:
    agent, horizon = AGENTS[name], 30
    plan = straight_plan(agent, horizon)
    assert plan is not None
    arrival = plan.arrival
    assert arrival == earliest_arrival(agent, horizon)
    assert excess(planned_controls(agent, horizon), plan.controls[:arrival]) <= 1e-7
    assert least_effort(agent, arrival - 1, horizon) is None, "otherwise it is not the fastest"
    found, best = float((plan.controls**2).sum()), least_effort(agent, arrival, horizon)
    assert best is not None
    if name != "sets that change":  # there, the straight line is kept
        assert found == pytest.approx(best, rel=1e-4, abs=1e-5)
    assert evaluate(Game((agent,), horizon=horizon), (plan,)).feasible


@pytest.mark.parametrize(
    ("goal", "control"),
    [
        ([40.0, 1.0], Polytope.box([20.0, 0.0])),
        ([30.0, 16.0], Polytope.from_vertices([[2, 1], [8, 4]])),
        ([-5.0, 0.0], Polytope.from_vertices([[1, 0], [3, 0], [3, 2]])),
        ([31.0, 15.5], Polytope.from_vertices([[2, 1]])),
    ],
)
def test_a_goal_beside_the_reach_of_the_set_has_no_plan(goal: list, control: Polytope) -> None:
    assert straight_plan(point(goal, control), 30) is None


def test_a_speed_limit_slows_straight_flight() -> None:
    free = accelerated([20.0, 3.0, 0.0, 0.0], Polytope.box([2.0, 2.0]))
    limited = AGENTS["speed limits"]
    fast, slow = straight_plan(free, 40), straight_plan(limited, 40)
    assert fast.arrival < slow.arrival
    assert fast.means[:, 2].max() > 1.5
    spread = workspace_limits(limited, 40)[: slow.arrival + 1].min(axis=1)
    assert (slow.means[1 : slow.arrival + 1, 2] <= spread[1:] + 1e-6).all()


def test_the_horizon_that_would_suffice_may_have_no_controls_left() -> None:
    agent = Agent(
        [0.0], [2.0], Polytope.box([1.0]), Polytope.box([0.3]), gain=0.05, noise=1.0, reserve=1.0
    )
    game = Game((agent,), horizon=5)
    assert earliest_arrival(agent, 5) is None
    assert sufficient_horizon(agent, 200) is None
    with pytest.raises(InputError, match="leaves no control at step"):
        planned_controls(agent, 200)
    answer = best_response(game, 0)
    assert answer.status == "unreachable"
    assert "agent_0 cannot reach its goal within the horizon of 5" in answer.advice
    assert sufficient_horizon(replace(agent, reserve=0.0), 200) == 14


def test_what_no_control_moves_need_not_be_moved() -> None:
    """The second component drifts to its goal by itself; the third is there already."""
    agent = Agent(
        [0.0, 8.0, 5.0], [9.0, 1.0, 5.0], Polytope.box([1.0]), Polytope.box([6.0]),
        A=np.diag([1.0, 0.5, 1.0]), B=[[1.0], [0.0], [0.0]], gain=np.zeros((1, 3)), noise=0.0,
    )  # fmt: skip
    plan = straight_plan(agent, 9)
    assert plan.arrival == 3
    assert plan.controls[:3, 0].tolist() == pytest.approx([3.0, 3.0, 3.0])
    assert best_response(Game((agent,), horizon=9), 0).evaluation.arrival == (3,)
    assert all(
        np.isfinite(matrix).all() for matrix, _ in least_effort_laws(agent, 9, agent.control)
    )
    away = replace(agent, goal=[9.0, 1.0, 6.0])
    assert straight_plan(away, 9) is None


def test_a_minimum_norm_plan_that_is_admissible_stays_as_it_is() -> None:
    for name in ("intersection", "circle(5)"):
        for agent in make_game(name, speed="l1").agents:
            plan = straight_plan(agent, 20)
            steps = np.linalg.lstsq(
                np.hstack([np.eye(2)] * plan.arrival), agent.goal - agent.start, rcond=None
            )[0]
            assert plan.controls[: plan.arrival].tolist() == steps.reshape(-1, 2).tolist()


def test_laws_leave_alone_what_no_control_moves() -> None:
    agent = Agent([0, 0], [9, 0], BODY, Polytope.box([2.0]), B=[[1.0], [0.0]], gain=[[0.5, 0.0]])
    laws = least_effort_laws(agent, 5, agent.control)
    assert len(laws) == 5
    for k, (matrix, offset) in enumerate(laws, start=1):
        assert matrix @ [3.0, 7.0] + offset == pytest.approx([6.0 / k])


@pytest.mark.parametrize("name", AGENTS)
def test_laws_of_one_step_after_the_other_reach_the_goal_of_the_last(name: str) -> None:
    agent = AGENTS[name]
    control = set_at(agent.control, 99)
    laws = least_effort_laws(agent, 12, control)
    for matrix, offset in laws:
        inputs = matrix @ agent.start + offset
        across = control.normals[control.offsets + control.support(-control.normals) <= 1e-12]
        beyond = across @ inputs - control.support(across)
        assert len(beyond) == 0 or np.abs(beyond).max() <= 1e-9, "leaves a flat set"
    if len(laws) == 1:
        return
    state = agent.start
    for matrix, offset in laws[::-1]:
        state = agent.A @ state + agent.B @ (matrix @ state + offset)
    reached = np.abs(state[: agent.goal.size] - agent.goal).max() <= 1e-6
    flat = len(across) > 0
    assert reached or flat or len(laws) < 12
