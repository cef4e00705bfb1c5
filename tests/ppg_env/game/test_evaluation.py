from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from ppg_env import (
    Agent,
    Game,
    InputError,
    Plan,
    Polytope,
    evaluate,
    make_game,
    make_plan,
    make_profile,
    straight_plan,
)
from ppg_env.game.objective import potential, selfish
from ppg_env.game.plan import Profile
from tests.oracles.slow_evaluator import slow_evaluation
from tests.ppg_env.strategies import Play, double_integrator, plays

CLOSE = {"rtol": 1e-9, "atol": 1e-9}


def straight(game: Game) -> Profile:
    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    assert all(plan is not None for plan in plans)
    return tuple(plans)  # type: ignore[arg-type]


def assert_agrees_with_the_slow_one(game: Game, controls: list[np.ndarray]) -> None:
    found, expected = evaluate(game, make_profile(game, controls)), slow_evaluation(game, controls)
    assert list(found.arrival) == expected.arrival
    np.testing.assert_allclose(found.safety_cost, expected.safety_cost, **CLOSE)
    np.testing.assert_allclose(found.deficit, expected.deficit, **CLOSE)
    np.testing.assert_allclose(found.risk_sum, expected.risk, **CLOSE)
    np.testing.assert_allclose(found.cost, expected.cost, **CLOSE)
    np.testing.assert_allclose(found.shifted_cost, expected.shifted_cost, **CLOSE)
    np.testing.assert_allclose(found.potential, expected.potential, **CLOSE)
    np.testing.assert_allclose(found.social_cost, sum(expected.shifted_cost), **CLOSE)


@given(plays(missing=True))
def test_a_slow_evaluator_in_plain_loops_agrees(play: Play) -> None:
    assert_agrees_with_the_slow_one(play.game, [np.array(rows) for rows in play.controls])


@pytest.mark.parametrize("objective", ["margin", "risk"])
def test_a_slow_evaluator_agrees_on_straight_plans(game: Game, objective: str) -> None:
    game = replace(game, objective=objective, margin_cap=None)
    assert_agrees_with_the_slow_one(game, [np.array(plan.controls) for plan in straight(game)])


@pytest.mark.parametrize("objective", ["margin", "risk"])
def test_a_slow_evaluator_agrees_on_double_integrators(objective: str) -> None:
    A, B = double_integrator(2)
    agents = [
        Agent(
            [10.0 * k, 0, 1, 0], [10.0 * k + 4, 8, 0, 0], Polytope.box([4, 4]), Polytope.l1(6),
            lam=0.2 + 0.3 * k, gain=np.hstack([0.3 * np.eye(2), 0.8 * np.eye(2)]),
            noise=np.diag([1.0, 0.5, 0.1, 0.2]), A=A, B=B,
        )
        for k in range(3)
    ]  # fmt: skip
    wall = Polytope.from_vertices([[-9, 9], [-5, 9], [-7, 12]])
    game = Game(tuple(agents), (wall,), 8, objective)
    assert_agrees_with_the_slow_one(game, [np.array(plan.controls) for plan in straight(game)])


@given(plays())
def test_a_unilateral_deviation_changes_cost_and_potential_alike(play: Play) -> None:
    """J_i changes by (1 - lam_i) times the change of Phi: an exact, weighted potential."""
    game, before = play.game, evaluate(play.game, play.profile)
    for i, agent in enumerate(game.agents):
        for rows in other_ways(play.controls[i]):
            plan = make_plan(agent, rows)
            assert plan.arrival is not None
            profile = tuple(plan if k == i else old for k, old in enumerate(play.profile))
            after = evaluate(game, profile)
            change = (1 - agent.lam) * (after.potential - before.potential)
            scale = max(1.0, abs(before.potential), abs(after.potential))
            assert after.cost[i] - before.cost[i] == pytest.approx(change, abs=1e-9 * scale)
            shifted = after.shifted_cost[i] - before.shifted_cost[i]
            assert shifted == pytest.approx(change, abs=1e-9 * scale)


def other_ways(rows: np.ndarray) -> list[np.ndarray]:
    """The same moves backwards and rotated: other paths, waits, and often other arrivals."""
    return [rows[::-1], np.roll(rows, 1, axis=0), np.roll(rows, 2, axis=0)]


@given(plays())
def test_cost_and_shifted_cost_differ_by_the_cap_over_all_times(play: Play) -> None:
    game, found = play.game, evaluate(play.game, play.profile)
    for i, agent in enumerate(game.agents):
        mine = sum(i in encounter.agents for encounter in game.encounters)
        most = mine * game.margin_cap * (game.horizon + 1)
        assert found.safety_cost[i] == pytest.approx(found.deficit[i] - most, abs=1e-9)
        shift = (1 - agent.lam) * most if game.objective == "margin" else 0.0
        assert found.shifted_cost[i] == pytest.approx(found.cost[i] + shift, abs=1e-9)
        assert found.shifted_cost[i] >= 0
    assert found.potential >= 0


@given(plays())
def test_the_deficit_and_the_risk_do_not_depend_on_the_horizon(play: Play) -> None:
    longer = replace(play.game, horizon=play.game.horizon + 7)
    rows = [np.concatenate([rows, np.zeros((7, 2))]) for rows in play.controls]
    one = evaluate(play.game, play.profile)
    other = evaluate(longer, make_profile(longer, rows))
    np.testing.assert_allclose(other.deficit, one.deficit, **CLOSE)
    np.testing.assert_allclose(other.risk_sum, one.risk_sum, **CLOSE)
    np.testing.assert_allclose(other.shifted_cost, one.shifted_cost, **CLOSE)


def test_the_margin_is_the_distance_over_sqrt_2_sigma() -> None:
    # Two unit boxes in step, 4 apart (3 between their sides), with variance 0.5 each after one
    # step: sigma = 1, so s = 3/sqrt(2); on the paper's scale 3.
    agents = [
        Agent([x, 0.0], [x, 3.0], Polytope.box([1, 1]), Polytope.box([2, 2]), gain=1.0, noise=0.5)
        for x in (0.0, 4.0)
    ]
    game = Game(tuple(agents), horizon=4, margin_cap=5.0)
    exact = evaluate(game, straight(game))
    np.testing.assert_allclose(exact.margins, [[5.0, 3 / np.sqrt(2), 3 / np.sqrt(2), 5.0, 5.0]])
    paper = evaluate(replace(game, scale="paper"), straight(game))
    np.testing.assert_allclose(paper.margins, [[5.0, 3.0, 3.0, 5.0, 5.0]])


def test_an_arrived_agent_is_out_of_traffic_from_its_arrival_on() -> None:
    game = make_game("head_on", goal={0: [30.0, 50.0]})  # arrives at 2; the other passes later
    found = evaluate(game, straight(game))
    assert found.arrival == (2, 9)
    assert found.traffic[0].tolist() == [True, True] + [False] * 14
    assert (found.margins[0, 2:] == game.margin_cap).all()
    assert found.feasible


def test_an_agent_that_starts_at_its_goal_is_never_in_traffic() -> None:
    game = make_game("head_on", goal={1: [90.0, 50.0]})
    found = evaluate(game, straight(game))
    assert not found.traffic.any()
    assert found.deficit.tolist() == [0.0, 0.0]
    assert found.risk_bound.tolist() == [0.0, 0.0]
    assert found.shifted_cost.tolist() == [4.5, 0.0]


@pytest.mark.parametrize("objective", ["margin", "risk"])
def test_at_time_zero_without_noise_the_margin_is_the_cap(game: Game, objective: str) -> None:
    game = replace(game, objective=objective, margin_cap=None)
    found = evaluate(game, straight(game))
    assert (found.margins[:, 0] == game.margin_cap).all()


def test_touching_bodies_without_noise_are_worth_the_cap() -> None:
    game = make_game("parallel", start={0: [10, 50], 1: [10, 35]}, goal={0: [95, 50], 1: [95, 35]})
    quiet = replace(game, agents=tuple(replace(agent, noise=0.0) for agent in game.agents))
    found = evaluate(quiet, straight(quiet))
    assert (found.margins == 3.0).all()
    assert found.feasible
    noisy = evaluate(game, straight(game))
    assert noisy.margins[0, 1] == pytest.approx(0.0, abs=1e-9)


def test_an_overlap_without_noise_costs_the_pair_everything_and_the_third_nothing() -> None:
    pair = make_game("head_on", noise=0.0).agents
    third = replace(pair[0], start=[10.0, 200.0], goal=[95.0, 200.0])
    game = Game((*pair, third))
    found = evaluate(game, straight(game))
    assert found.shifted_cost[:2].tolist() == [np.inf, np.inf]
    assert found.potential == np.inf
    assert found.deficit[2] == 0.0
    assert found.shifted_cost[2] == pytest.approx(0.5 * 9)
    assert found.cost[2] == pytest.approx(0.5 * 9 - 0.5 * 2 * 3 * 16)


@pytest.mark.parametrize("lam", [0.0, 0.5])
def test_without_arrival_the_cost_is_infinite(lam: float) -> None:
    game = make_game("parallel", lam=lam)
    still = make_plan(game.agents[0], np.zeros((15, 2)))
    found = evaluate(game, (still, straight(game)[1]))
    assert found.arrival == (None, 9)
    assert found.cost[0] == found.shifted_cost[0] == found.potential == np.inf
    assert np.isfinite(found.cost[1])
    assert found.traffic[0].tolist() == [True] * 9 + [False] * 7  # until the other arrives
    assert not found.feasible


def test_complaints_name_the_overlap_and_both_parties() -> None:
    game = make_game("head_on")
    found = evaluate(game, straight(game))
    (sentence,) = found.violations()
    assert "agent_0" in sentence
    assert "agent_1" in sentence
    assert "overlap" in sentence
    assert not found.feasible
    # At time 4 they are 80 - 8 * 85/9 = 4.44 apart, where 15 is due.
    assert found.residuals.overlap[0] == pytest.approx(15 - (80 - 8 * 85 / 9))


def test_complaints_name_the_obstacle() -> None:
    game = make_game("course")
    wall = Polytope.from_vertices([[40, 0], [50, 0], [50, 100], [40, 100]])
    game = replace(game, obstacles=(*game.obstacles, wall))
    violations = evaluate(game, straight(game)).violations()
    assert any(
        "agent_0" in text and f"obstacle {len(game.obstacles) - 1}" in text for text in violations
    )


def test_complaints_name_a_goal_that_is_missed_and_by_how_much() -> None:
    game = make_game("parallel")
    short = make_plan(game.agents[1], np.tile([5.0, 0.0], (15, 1)))
    found = evaluate(game, (straight(game)[0], short))
    (sentence,) = found.violations()
    assert "agent_1" in sentence
    assert "goal" in sentence
    assert "10" in sentence
    assert found.violations([0]) == ()
    assert found.residuals.goal[1] == pytest.approx(10.0)


def test_complaints_name_a_control_that_leaves_its_set() -> None:
    game = make_game("parallel")
    fast = np.zeros((15, 2))
    fast[:5, 0] = 17.0
    found = evaluate(game, (make_plan(game.agents[0], fast), straight(game)[1]))
    (sentence,) = found.violations()
    assert "control" in sentence
    assert "agent_0" in sentence
    assert found.residuals.control[0] == pytest.approx(7.0)


def test_a_clean_plan_has_no_complaints() -> None:
    found = evaluate(make_game("parallel"), straight(make_game("parallel")))
    assert found.violations() == ()
    assert found.feasible
    for residual in (found.residuals.control, found.residuals.goal, found.residuals.overlap):
        assert residual.max() <= 1e-9


def test_the_paper_scale_gives_no_bound() -> None:
    game = make_game("parallel", scale="paper")
    found = evaluate(game, straight(game))
    with pytest.raises(InputError, match="not a bound"):
        _ = found.risk_bound
    with pytest.raises(InputError, match="not a bound"):
        _ = found.risk_bound_any
    assert found.risk_sum.shape == (2,)


def test_means_and_arrivals_that_do_not_follow_from_the_controls_are_not_believed() -> None:
    game = make_game("head_on")
    honest = straight(game)
    far = honest[0].means + np.array([0.0, 500.0])
    liar = Plan(honest[0].controls, far, 1)
    reported = evaluate(game, (liar, honest[1]))
    truth = evaluate(game, honest)
    assert reported.arrival == truth.arrival or not reported.feasible
    assert reported.shifted_cost[0] >= truth.shifted_cost[0] - 1e-9 or not reported.feasible


def test_a_profile_of_another_game_is_judged_by_this_one() -> None:
    elsewhere = make_game("parallel")
    game = make_game("head_on")
    found = evaluate(game, straight(elsewhere))
    assert not found.feasible  # its controls lead from head_on's starts past head_on's goals


@given(plays(scale="exact"))
def test_the_bound_for_any_agent_is_between_the_largest_and_the_sum(play: Play) -> None:
    found = evaluate(play.game, play.profile)
    assert found.risk_bound.max() <= found.risk_bound_any + 1e-12
    assert found.risk_bound_any <= found.risk_bound.sum() + 1e-12


@given(plays())
def test_the_value_of_an_objective_is_the_cost_that_it_states(play: Play) -> None:
    found = evaluate(play.game, play.profile)
    values = [found.weighted(selfish(play.game, i)) for i in range(len(play.game.agents))]
    np.testing.assert_allclose(values, found.shifted_cost, **CLOSE)
    np.testing.assert_allclose(found.weighted(potential(play.game)), found.potential, **CLOSE)


@given(plays(missing=True))
def test_feasibility_is_the_absence_of_violations_for_any_agents(play: Play) -> None:
    evaluation = evaluate(play.game, play.profile)
    for agents in (None, (), (0,), range(len(play.game.agents))):
        assert evaluation.is_feasible(agents) == (not evaluation.violations(agents))
