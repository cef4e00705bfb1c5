from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from ppg_env import (
    Agent,
    Game,
    InputError,
    Polytope,
    make_game,
    make_plan,
    make_profile,
    straight_plan,
)
from ppg_env.game.dynamics import rollout
from tests.ppg_env.strategies import Play, double_integrator, plays


@given(plays())
def test_an_arrived_agent_stays_where_it_is_with_controls_of_zero(play: Play) -> None:
    for agent, plan in zip(play.game.agents, play.profile, strict=True):
        assert plan.arrival is not None
        there = np.abs(plan.means - agent.goal).max(axis=1) <= 1e-6
        assert plan.arrival == np.flatnonzero(there)[0]
        assert not plan.controls[plan.arrival :].any()
        assert (plan.means[plan.arrival :] == plan.means[plan.arrival]).all()
        before = plan.controls[: plan.arrival]
        np.testing.assert_array_equal(rollout(agent, before), plan.means[: plan.arrival + 1])


def test_controls_that_lead_past_the_goal_end_there() -> None:
    agent = make_game("head_on", goal={0: [30.0, 50.0]}).agents[0]
    plan = make_plan(agent, np.tile([10.0, 0.0], (15, 1)))
    assert plan.arrival == 2
    assert plan.controls[:, 0].tolist() == [10.0] * 2 + [0.0] * 13
    assert plan.means[:, 0].tolist() == [10.0, 20.0] + [30.0] * 14


def test_a_plan_that_misses_its_goal_has_no_arrival() -> None:
    agent = make_game("head_on").agents[0]
    plan = make_plan(agent, np.tile([5.0, 0.0], (15, 1)))
    assert plan.arrival is None
    assert plan.means[-1].tolist() == [85.0, 50.0]


def test_an_agent_that_starts_at_its_goal_has_arrived() -> None:
    agent = make_game("head_on", goal={0: [10.0, 50.0]}).agents[0]
    plan = straight_plan(agent, 4)
    assert plan is not None
    assert plan.arrival == 0
    assert not plan.controls.any()


def test_the_straight_plan_of_a_point_mass_goes_at_constant_speed() -> None:
    plan = straight_plan(make_game("head_on").agents[0], 15)
    assert plan is not None
    assert plan.arrival == 9
    np.testing.assert_allclose(plan.controls[:9], np.tile([85 / 9, 0.0], (9, 1)))


def test_the_straight_plan_of_a_double_integrator_stops_at_its_goal() -> None:
    A, B = double_integrator(2)
    body, control, gain = Polytope.box([1, 1]), Polytope.box([4, 4]), np.zeros((2, 4))
    agent = Agent([0, 0, 0, 0], [6, 2, 0, 0], body, control, gain=gain, A=A, B=B)
    plan = straight_plan(agent, 10)
    assert plan is not None
    assert plan.arrival is not None
    np.testing.assert_allclose(plan.means[plan.arrival], agent.goal, atol=1e-6)
    assert agent.control.clearance(plan.controls).max() <= 1e-7


def test_there_is_no_straight_plan_to_a_goal_out_of_reach() -> None:
    assert straight_plan(make_game("head_on").agents[0], 8) is None


@pytest.mark.parametrize(
    ("controls", "place"),
    [
        ([np.zeros((15, 2))], "controls"),
        ([np.zeros((15, 2))] * 3, "controls"),
        ([np.zeros((15, 2)), np.zeros((14, 2))], r"controls\[1\]"),
        ([np.zeros((15, 3)), np.zeros((15, 2))], r"controls\[0\]"),
        ([np.zeros((15, 2)), np.full((15, 2), np.nan)], r"controls\[1\]"),
        ([np.zeros((15, 2)), np.full((15, 2), np.inf)], r"controls\[1\]"),
        ([np.zeros((15, 2)), [[0.0, 0.0]] * 14 + [[0.0]]], r"controls\[1\]"),
        ([np.zeros((15, 2)), "fast"], r"controls\[1\]"),
        ([np.zeros((15, 2)), None], r"controls\[1\]"),
        ([np.zeros((15, 2)), [[10**400, 0]] * 15], r"controls\[1\]"),
    ],
)
def test_controls_of_the_wrong_size_or_kind_are_refused(controls: list, place: str) -> None:
    with pytest.raises(InputError, match=place):
        make_profile(make_game("head_on"), controls)


def test_the_callers_controls_are_left_alone() -> None:
    mine = np.tile([10.0, 0.0], (15, 1))
    make_plan(make_game("head_on").agents[0], mine)
    assert (mine == [10.0, 0.0]).all()


def test_straight_plans_stay_in_their_control_sets(game: Game) -> None:
    for agent in game.agents:
        plan = straight_plan(agent, game.horizon)
        assert plan is not None
        assert agent.control.clearance(plan.controls).max() <= 1e-7
        way = agent.goal - agent.start
        steps = np.arange(plan.arrival + 1)[:, None] / plan.arrival
        np.testing.assert_allclose(
            plan.means[: plan.arrival + 1], agent.start + steps * way, atol=1e-9
        )


@pytest.mark.parametrize("control", [np.inf, np.nan, 1e308, 10**400, 1j, "x"])
def test_controls_that_are_no_numbers_are_refused(control):
    agent = make_game("head_on").agents[0]
    with pytest.raises(InputError, match="controls"):
        make_plan(agent, [[control, 0.0]] * 3)
