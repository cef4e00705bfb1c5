"""Arrival regions: half a step wide, whatever the unit; and no agent arrives before it moves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ppg_env import Agent, Game, InputError, Polytope, Simulator, make_game, parallel_env
from ppg_env.env.arrival_regions import arrival_tolerances
from ppg_env.env.players import GoToGoal
from ppg_env.env.rules import Rules
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.obstacle import Obstacle
from ppg_env.scenarios.make import SPEEDS
from tests.ppg_env.env.test_rules import GAMES

BODY = Polytope.box([4.0, 4.0])


@pytest.mark.parametrize("speed", SPEEDS)
def test_in_the_paper_s_scenarios_it_is_five(scenario: str, speed: str) -> None:
    if speed == "disc" and make_game(scenario).dim != 2:
        pytest.skip("a disc is for the plane")
    game = make_game(scenario, speed=speed)
    assert all((half == 5.0).all() for half in arrival_tolerances(game))
    assert (Simulator(game).tables.tolerance == 5.0).all()


def lone(control: Any, **fields: Any) -> Agent:
    return Agent(np.zeros(2), np.array([90.0, 40.0]), BODY, control, **fields)


@pytest.mark.parametrize(
    ("control", "half"),
    [
        (Polytope.box([8.0, 2.0]), [2.0, 0.5]),
        (Polytope.l1(6.0), [3.0, 3.0]),
        (Polytope.from_vertices([(4, -1), (9, 0), (4, 1)]), [4.5, 0.5]),  # always forwards
        (((0, Polytope.box([8.0, 8.0])), (3, Polytope.box([2.0, 12.0]))), [2.0, 3.0]),
        (Polytope.box([8.0, 0.0]), [2.0, 2.0]),  # moved sideways by the noise alone
        (Polytope.box([0.0, 0.0]), [0.0, 0.0]),
    ],
)
def test_it_is_half_of_the_longest_step_per_component(control: Any, half: list[float]) -> None:
    (found,) = arrival_tolerances(Game((lone(control),)))
    np.testing.assert_allclose(found, half, rtol=1e-12)


def test_a_matrix_of_inputs_counts_and_a_number_holds_for_all() -> None:
    game = Game((lone(Polytope.box([2.0, 2.0]), B=[[3.0, 1.0], [0.0, 0.5]]),))
    np.testing.assert_allclose(arrival_tolerances(game)[0], [2.0, 0.25])
    assert arrival_tolerances(game, 0.7)[0].tolist() == [0.7, 0.7]
    np.testing.assert_array_equal(
        Simulator(game, Rules(tolerance=0.7)).tables.tolerance, [[0.7] * 2]
    )


def glider(goal: list[float], **fields: Any) -> Agent:
    """A double integrator on a line, pushed by at most 1 per step, that starts at rest."""
    A, B = [[1.0, 1.0], [0.0, 1.0]], [[0.5], [1.0]]
    return Agent([0.0, 0.0], goal, Polytope.box([3.0]), Polytope.box([2.0]), A=A, B=B, noise=0.01,
                 gain=[[0.2, 0.8]], **fields)  # fmt: skip


def test_a_double_integrator_flies_as_fast_as_its_way_allows_or_its_workspace() -> None:
    """From rest to rest in 2 k steps it covers k^2, and passes the middle with speed k."""
    for k in (3, 5):
        (half,) = arrival_tolerances(Game((glider([float(k * k), 0.0]),), horizon=40))
        np.testing.assert_allclose(half, [(k + 0.5) / 2, 0.5], atol=1e-6)
    limit = HalfSpaces.between([-1e3, -2.0], [1e3, 2.0])
    (half,) = arrival_tolerances(Game((glider([25.0, 0.0], within=limit),), horizon=40))
    np.testing.assert_allclose(half, [(2.0 + 0.5) / 2, 0.5], atol=1e-6)
    (half,) = arrival_tolerances(Game((glider([25.0, 0.0], reserve=1.0),), horizon=40))
    np.testing.assert_allclose(half, [(5.0 + 0.5) / 2, 0.5], atol=1e-6)


def test_an_agent_that_starts_inside_its_region_is_refused_unless_it_starts_at_its_goal() -> None:
    near = make_game("head_on", start={0: [91.0, 52.0], 1: [50.0, 50.0]})
    with pytest.raises(
        InputError, match=r"^agent\[0\]\.start: is inside .*5; pass a tolerance below 4"
    ):
        parallel_env(near)
    with pytest.raises(InputError, match=r"^agent\[0\]\.start: is inside"):
        Simulator(near, Rules(tolerance=4.0))
    Simulator(near, Rules(tolerance=3.9))
    Simulator(near, Rules(arrival="schedule", schedule=(3, 9)))
    there = make_game("head_on", start={0: [95.0, 50.0], 1: [50.0, 50.0]})
    simulator = Simulator(there, Rules(on_goal="stay"))
    simulator.reset()
    assert simulator.status[0].tolist() == [1, 0]
    assert parallel_env(there).reset(seed=0)[1]["agent_0"]["arrived"] is True


def resized(polytope: Polytope, unit: float) -> Polytope:
    return Polytope.from_vertices(polytope.vertices * unit)


def in_units(game: Game, unit: float) -> Game:
    """The game with every length multiplied by ``unit``; times stay, so velocities scale too."""
    agents = []
    for agent in game.agents:
        sets = agent.control if isinstance(agent.control, tuple) else ((0, agent.control),)
        agents.append(
            replace(
                agent,
                start=agent.start * unit,
                goal=agent.goal * unit,
                shape=resized(agent.shape, unit),
                control=[(first, resized(control, unit)) for first, control in sets],
                noise=agent.noise * unit**2,
                sigma0=agent.sigma0 * unit**2,
                effort=agent.effort / unit,
            )
        )
    obstacles = [
        Obstacle(
            resized(obstacle.shape, unit),
            None if obstacle.path is None else obstacle.path * unit,
            obstacle.noise * unit**2,
            obstacle.until,
        )
        for obstacle in game.obstacles
    ]
    return replace(game, agents=tuple(agents), obstacles=tuple(obstacles))


def outcome(game: Game, rules: Rules, seed: int, unit: float) -> dict[str, np.ndarray]:
    """Everything that comes out of some episodes, lengths excepted."""
    simulator = Simulator(game, rules, copies=16, seed=seed)
    random = np.random.default_rng(seed)
    players = [GoToGoal(game, i) for i in range(len(game.agents))]
    trail = [simulator.reset().copy()]
    events: dict[str, list[np.ndarray]] = {"arrived": [], "crashed": [], "over": [], "reward": []}
    for _ in range(20):
        action = random.normal(0, 1.5 * unit, (16, *simulator.low.shape))
        for i, player in enumerate(players):
            action[:, i, : game.agents[i].control_dim] += player.act(simulator.view(i))
        step = simulator.step(action)
        trail.append(step.observation.copy())
        for key, log in events.items():
            log.append(getattr(step, key).copy())
    return {"observation": np.array(trail), **{key: np.array(log) for key, log in events.items()}}


UNITS = [1e-3, 1e3, 2.0**-10, 2.0**10]
QUICK = ["crowded", "tired", "haunted-swept"]


@settings(max_examples=6, deadline=None)
@given(st.sampled_from(QUICK), st.sampled_from(UNITS), st.sampled_from(["risk", "margin"]),
       st.integers(0, 99))  # fmt: skip
def test_a_game_in_another_unit_plays_the_same(
    kind: str, unit: float, reward: str, seed: int
) -> None:
    compare_units(kind, unit, reward, seed)


@pytest.mark.slow
@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("kind", GAMES)
def test_every_game_in_another_unit_plays_the_same(kind: str, unit: float) -> None:
    for reward in ("risk", "margin"):
        compare_units(kind, unit, reward, seed=5)


def compare_units(kind: str, unit: float, reward: str, seed: int) -> None:
    plain, rules = GAMES[kind](), Rules(reward=reward, on_crash="continue", max_cycles=14)
    scaled = in_units(plain, unit)
    np.testing.assert_allclose(
        np.concatenate(arrival_tolerances(scaled)),
        unit * np.concatenate(arrival_tolerances(plain)), rtol=1e-9,
    )  # fmt: skip
    one, other = outcome(plain, rules, seed, 1.0), outcome(scaled, rules, seed, unit)
    for key in ("arrived", "crashed", "over"):
        np.testing.assert_array_equal(one[key], other[key])
    assert one["arrived"].any()
    assert one["crashed"].any()
    np.testing.assert_allclose(one["reward"], other["reward"], rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(one["observation"], other["observation"], rtol=1e-4, atol=1e-5)
