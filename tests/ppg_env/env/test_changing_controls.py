"""Players and environment where control sets change over time."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import Game, Polytope, make_game, straight_plan
from ppg_env.env.kernel import BLOCK
from ppg_env.env.parallel_env import PathPlanningEnv
from ppg_env.env.players import GoToGoal, Player, straight_players, track
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator
from ppg_env.game.input_sets import excess
from solvers import social_optimum
from solvers.feedback.replanning.replanner import replanning

FAST, SLOW, STILL = (Polytope.box([2.0 * speed] * 2) for speed in (10.0, 4.0, 0.0))
TIRING = ((0, FAST), (4, SLOW))


def played(game: Game, players: list[Player], copies: int = 1) -> np.ndarray:
    """Actions (t, C, N, m) up to the end of the first episode; those of agents on their way."""
    simulator, actions = Simulator(game, Rules(tolerance=1e-6), copies), []
    simulator.reset()
    while (simulator.status == 0).any() and len(actions) < 40:
        action = np.zeros((copies, len(players), simulator.action_size))
        for i, player in enumerate(players):
            there = simulator.status[:, i] == 0
            action[there, i] = player.act(simulator.view(i))[there]
        simulator.step(action, restart=False)
        actions.append(action.copy())
    return np.array(actions)


@pytest.mark.parametrize(
    ("control", "late"),
    [(((0, SLOW), (4, FAST)), 0), (((0, STILL), (3, FAST)), 0), (TIRING, 1)],
)
def test_homing_makes_the_most_of_the_set_that_holds(control: object, late: int) -> None:
    """It looks no further ahead: where sets shrink it may save a little too much at first."""
    game = make_game("parallel", noise=0.0, control=control, horizon=30)
    actions = played(game, [GoToGoal(game, i) for i in range(2)])
    straight = [straight_plan(mover, game.horizon).arrival for mover in game.agents]
    assert max(straight) <= len(actions) <= max(straight) + late
    for i, mover in enumerate(game.agents):
        held = mover.control_at(0)
        assert held == STILL or excess(mover.control, actions[:, 0, i]) <= 1e-7


def test_every_block_of_copies_moves_by_the_set_of_its_own_time() -> None:
    """The kernel takes copies in blocks; the second block is two steps later than the first."""
    game = make_game("parallel", noise=0.0, control=((0, FAST), (1, SLOW)))
    simulator = Simulator(game, Rules(), copies=BLOCK + 2)
    simulator.reset()
    simulator.clock[BLOCK:] = 2
    before = simulator.state.copy()
    simulator.step(np.full((BLOCK + 2, 2, 2), 50.0), restart=False)
    moved = simulator.state - before
    np.testing.assert_allclose(moved[:BLOCK], 10.0, atol=1e-9)
    np.testing.assert_allclose(moved[BLOCK:], 4.0, atol=1e-9)


def test_homing_looks_at_the_clock_of_every_copy() -> None:
    game = make_game("parallel", control=TIRING)
    homing, states = GoToGoal(game, 0), np.tile(game.agents[0].start, (4, 1))
    clock = np.array([0, 5, 3, 77])
    together = homing.towards_goal(states, clock)
    for k in range(4):
        alone = homing.towards_goal(states[k : k + 1], clock[k : k + 1])
        np.testing.assert_allclose(together[k], alone[0], atol=1e-12)
    assert np.abs(together[[0, 2]]).max(axis=1).min() > 4.0
    np.testing.assert_allclose(together[1], together[3])


def crossing(**fields: object) -> Game:
    return make_game("intersection", control=((0, FAST), (3, SLOW)), lam=0.8, gain=0.0,
                     margin_cap=5.0, horizon=26, noise=0.0, **fields)  # fmt: skip


def test_a_plan_is_tracked_inside_its_sets_and_costs_what_was_planned() -> None:
    game = crossing()
    solution = social_optimum(game)
    actions = played(game, track(game, solution.profile))
    for i, mover in enumerate(game.agents):
        arrival = solution.profile[i].arrival
        assert excess(mover.control, actions[:arrival, 0, i]) <= 1e-7
        np.testing.assert_allclose(actions[:arrival, 0, i], solution.profile[i].controls[:arrival])


def test_later_plans_use_the_sets_to_come() -> None:
    game = crossing()
    profile = social_optimum(game).profile
    actions = played(
        game, list(replanning(game, profile, social=True, rules=Rules(tolerance=1e-6)))
    )
    assert len(actions) <= max(plan.arrival for plan in profile), "no time is lost"
    for i, mover in enumerate(game.agents):
        assert excess(mover.control, actions[:, 0, i]) <= 1e-7


def test_actions_are_projected_on_the_set_of_the_step_and_the_space_holds_all() -> None:
    ball = Polytope.l1(3.0)
    game = make_game("head_on", control=((0, FAST), (1, ball), (2, SLOW)), noise=0.0)
    env = PathPlanningEnv(game, max_cycles=40)
    env.reset(seed=0)
    space = env.action_space("agent_0")
    assert space.high.tolist() == [10.0, 10.0]
    for wanted in ([10, 10], [1.5, 1.5], *[[4, 4]] * 20):  # beyond the horizon of 15 too
        before = env.simulator.state[0, 0].copy()
        env.step({name: np.array([10.0, 10.0]) for name in env.agents})
        np.testing.assert_allclose(env.simulator.state[0, 0] - before, wanted, atol=1e-9)


def test_straight_players_fly_where_sets_change() -> None:
    game = make_game("parallel", control=TIRING, noise=0.0, horizon=20)
    assert all(player.information == "own state" for player in straight_players(game))
    assert len(played(game, straight_players(game))) == straight_plan(game.agents[0], 20).arrival
