"""Players that plan again for all agents: costs, plans and what they do not depend on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, make_game
from ppg_env.env.arrays import make_tables
from ppg_env.env.episodes import evaluate, mean_interval
from ppg_env.env.players import track
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator
from ppg_env.errors import InputError
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.input_sets import excess
from ppg_env.game.plan import Profile
from ppg_env.risk.overlap import log_overlap
from solvers import best_response_dynamics, social_optimum
from solvers.feedback.replanning.costs import pair_risk
from solvers.feedback.replanning.meetings import make_meetings
from solvers.feedback.replanning.motion import make_motion
from solvers.feedback.replanning.replanner import JointReplanner, replanning
from solvers.feedback.replanning.rollout import GO, KEEP, roll
from tests.marks import first

SHIFTED = ((0, Polytope.box([20.0, 20.0])), (3, Polytope.l1(6.0)))
RING = np.array([[np.cos(a), np.sin(a)] for a in np.arange(3) * 2 * np.pi / 3])


def planned(game: Game, *, social: bool) -> Profile:
    solution = (social_optimum if social else best_response_dynamics)(game)
    assert solution.profile is not None
    return solution.profile


def tables_of(game: Game) -> Any:
    return make_tables(game, Rules().of(game))


def paired(name: str, speed: str, lam: float, *, social: bool, episodes: int) -> Any:
    """Interval of the cost of replanning less that of the tracked plan, with the same noise."""
    game = make_game(name, speed=speed, lam=lam, objective="risk")
    profile = planned(game, social=social)
    costs = [
        evaluate(game, players, episodes, seed=3).cost.mean(axis=1)
        for players in (replanning(game, profile, social=social), track(game, profile))
    ]
    return mean_interval(costs[0] - costs[1])


@pytest.mark.parametrize("social", first(1, [False, True]))
def test_replanning_costs_less_than_tracking_where_agents_meet(*, social: bool) -> None:
    assert paired("head_on", "l1", 0.8, social=social, episodes=50).high < 0


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("social", [False, True])
@pytest.mark.parametrize("lam", [0.1, 0.9])
@pytest.mark.parametrize("speed", ["l1", "disc", "box"])
@pytest.mark.parametrize("name", ["opposing", "parallel", "intersection", "intersection3"])
def test_replanning_never_costs_more_than_tracking(
    name: str, speed: str, lam: float, *, social: bool
) -> None:
    assert paired(name, speed, lam, social=social, episodes=60).low <= 0


@pytest.mark.parametrize("speed", ["l1", "disc", "box"])
def test_candidates_are_admissible_and_follow_the_dynamics(speed: str) -> None:
    game = make_game("intersection", speed=speed)
    if speed == "box":
        game = replace(game, agents=tuple(replace(a, control=SHIFTED) for a in game.agents))
    motion, random = (
        make_motion(game, tables_of(game), planned(game, social=False)),
        np.random.default_rng(0),
    )
    agent, L = game.agents[0], game.horizon
    means, inputs, alive = np.zeros((L + 1, 2)), np.zeros((L, 2)), np.zeros(L + 1)
    kept, steps = np.zeros((L, 2)), 0
    for trial in range(200):
        means[0] = agent.start + random.normal(scale=3.0, size=2)
        start = int(random.integers(3))
        stop, move = start + int(random.integers(4)), int(random.integers(motion.moves.shape[1]))
        size, after = (1.0, 0.4)[trial % 2], (GO, KEEP)[trial % 2]
        cost = roll(motion, 0, 0, 0.5, kept, steps, start, stop, move, size, after, means,
                    inputs, alive, np.zeros((3, 2)))  # fmt: skip
        steps = int((alive[:L] > 0).sum())
        assert excess(agent.control, inputs[:steps]) <= 1e-7
        np.testing.assert_allclose(np.diff(means[: steps + 1], axis=0), inputs[:steps], atol=1e-9)
        assert (np.diff(alive) <= 0).all()
        assert alive[0] == 1.0
        assert cost == pytest.approx(0.5 * (alive[:L].sum() + L * alive[L]))
        kept[:] = inputs


def test_overlap_of_boxes_is_the_exact_probability() -> None:
    game = make_game("head_on")
    meetings, steps = make_meetings(game, tables_of(game)), 3
    (encounter,) = game.encounters
    alive, still = np.ones((2, steps + 1)), np.array([1.0, 1.0, 0.0, 0.0])
    for distance in ([16.0, 3.0], [14.0, 16.0], [20.0, 0.0], [0.0, 30.0]):
        first = np.zeros((steps + 1, 2))
        second = np.tile(np.array(distance), (steps + 1, 1))
        noise = game.agents[0].noise + game.agents[1].noise
        exact = np.exp(log_overlap(encounter.collision, first[:1] - second[:1], noise[None]))
        risk = pair_risk(meetings, 0, first, second, alive[0], still, steps)
        np.testing.assert_allclose(risk, exact[0], atol=2e-4)
        assert pair_risk(meetings, 0, second, first, still, alive[0], steps) >= 0.0


def test_episodes_do_not_depend_on_the_others_in_a_batch() -> None:
    game = make_game("intersection", speed="disc")
    profile = planned(game, social=True)
    few, many = (evaluate(game, replanning(game, profile, social=True), n, seed=1) for n in (3, 8))
    np.testing.assert_array_equal(few.cost, many.cost[:3])


def test_players_decide_alike_whether_or_not_they_share_plans() -> None:
    game = make_game("head_on", speed="l1")
    profile = planned(game, social=False)
    shared = replanning(game, profile, social=False)
    own = [replanning(game, profile, social=False)[i] for i in range(2)]
    together, apart = (evaluate(game, players, 6, seed=2) for players in (shared, own))
    np.testing.assert_array_equal(together.cost, apart.cost)


def test_another_episode_starts_without_the_plans_of_the_last_one() -> None:
    game = make_game("head_on", speed="l1")
    players = replanning(game, planned(game, social=True), social=True)
    first, second = (evaluate(game, players, 4, seed=5) for _ in range(2))
    np.testing.assert_array_equal(first.cost, second.cost)


def double_integrators() -> Game:
    """Two on a line with velocities as states; both stop behind where the other one starts."""
    A, B = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[0.5], [1.0]])
    fields = {
        "shape": Polytope.box([4.0]), "control": Polytope.box([4.0]), "A": A, "B": B,
        "noise": 0.01, "gain": np.array([[0.3, 0.9]]), "lam": 0.5,
    }  # fmt: skip
    agents = (Agent([0.0, 0.0], [20.0], **fields), Agent([30.0, 0.0], [50.0], **fields))
    return Game(agents, horizon=20, objective="risk")


def ring() -> Game:
    """Three in space swap sides."""
    starts = np.column_stack([40 * RING, [0.0, 1.0, 2.0]])
    agents = [
        Agent(
            s, -s, Polytope.box([8.0] * 3), Polytope.box([16.0] * 3), noise=0.5, gain=0.5, lam=0.5
        )
        for s in starts
    ]
    return Game(tuple(agents), horizon=15, objective="risk")


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("social", [False, True])
@pytest.mark.parametrize("make", [double_integrators, ring])
def test_any_dimension_and_dynamics(make: Any, *, social: bool) -> None:
    game = make()
    profile = planned(game, social=False)
    played = evaluate(game, replanning(game, profile, social=social), 10, seed=0)
    tracked = evaluate(game, track(game, profile), 10, seed=0)
    assert played.arrived.all()
    assert played.cost.mean() <= tracked.cost.mean() + 1e-9


def test_means_stay_in_the_workspace() -> None:
    """The lane is so narrow that agents can pass on one side only."""
    lane = HalfSpaces(np.array([[0.0, 1.0]]), np.array([52.0]))
    game = make_game("head_on", speed="box", noise=0.0, lam=0.5)
    game = replace(game, agents=tuple(replace(a, within=(lane,)) for a in game.agents))
    joint = JointReplanner(game, planned(game, social=True), social=True)
    simulator = Simulator(game)
    simulator.reset()
    while simulator.alive.any():
        simulator.step(joint.plan(simulator.view(0)), restart=False)
        assert simulator.state[0, :, 1].max() <= 52.0 + 1e-6
        if (simulator.status[0] != 0).all():
            break
    assert simulator.status[0].tolist() == [1, 1]


def test_plans_of_another_game_are_refused() -> None:
    game = make_game("head_on")
    profile = planned(game, social=False)
    with pytest.raises(InputError, match="profile"):
        replanning(game, profile[:1], social=True)
    with pytest.raises(InputError, match="profile"):
        replanning(make_game("head_on", horizon=20), profile, social=True)
