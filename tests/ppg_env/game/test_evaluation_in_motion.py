"""The evaluator in games whose bodies keep apart between steps, park, work and move obstacles."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env import Agent, Game, InputError, Polytope, evaluate, make_plan, make_profile
from ppg_env import tolerances as tol
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.obstacle import Obstacle
from tests.marks import slow_if
from tests.oracles.mixed_games import FLAT, mixed_game
from tests.oracles.slow_evaluator import slow_evaluation
from tests.ppg_env.strategies import Play, plays
from tests.profiles import examples

CLOSE = {"rtol": 1e-9, "atol": 1e-9}


@st.composite
def plays_in_motion(draw: st.DrawFn) -> Play:
    """Plays with efforts, a moving obstacle, and other rules of collisions and goals."""
    play = draw(plays(scale="exact"))
    path = draw(st.lists(st.tuples(st.integers(0, 50), st.integers(-12, 40)), max_size=4))
    shuttle = Obstacle(
        Polytope.box([4.0, 4.0]),
        path=np.array([(-40, 0), *path], dtype=float),
        noise=draw(st.sampled_from([0.0, 0.7])),
        until=draw(st.none() | st.integers(1, 4)),
    )
    agents = [replace(a, effort=draw(st.sampled_from([0.0, 0.125, 2.0]))) for a in play.game.agents]
    game = replace(
        play.game,
        agents=tuple(agents),
        obstacles=(*play.game.obstacles, shuttle),
        collisions=draw(st.sampled_from(["instants", "swept", "swept"])),
    )
    if draw(st.booleans()):
        with suppress(InputError):  # two goals may be too near for parked bodies
            game = replace(game, on_goal="stay")
    return Play(game, play.controls)


def assert_agrees_with_the_slow_one(game: Game, controls: list[np.ndarray]) -> None:
    found, expected = evaluate(game, make_profile(game, controls)), slow_evaluation(game, controls)
    assert list(found.arrival) == expected.arrival
    for name in ("safety_cost", "deficit", "effort", "cost", "shifted_cost", "potential"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), **CLOSE)
    np.testing.assert_allclose(found.risk_sum, expected.risk, **CLOSE)
    np.testing.assert_allclose(found.residuals.overlap, expected.overlap, **CLOSE)
    for i, agent in enumerate(game.agents):
        for name, unit in (("within", agent.unit), ("control", agent.control_unit)):
            beyond, other = getattr(found.residuals, name)[i], getattr(expected, name)[i]
            assert beyond == pytest.approx(other, rel=1e-8, abs=1e-9 * unit), (name, i)
    bad = [max(expected.control), max(expected.within), max([0.0, *expected.overlap])]
    assert found.feasible == (None not in expected.arrival and max(bad) <= tol.LENGTH)


@examples(0.25)
@given(plays_in_motion())
def test_a_slow_evaluator_agrees_on_plays_in_motion(play: Play) -> None:
    assert_agrees_with_the_slow_one(play.game, [np.array(rows) for rows in play.controls])


@pytest.mark.parametrize("seed", slow_if(lambda seed: seed not in FLAT[:6], range(24)))
def test_a_slow_evaluator_agrees_on_mixed_games_in_motion(seed: int) -> None:
    mixed = mixed_game(seed, 2 + seed % 2, in_motion=True)
    controls = [np.array(plan.controls) for plan in mixed.profile]
    for change in (np.copy, np.flipud, lambda rows: 1.3 * rows):
        assert_agrees_with_the_slow_one(mixed.game, [change(rows) for rows in controls])


@examples(0.25)
@given(plays_in_motion())
def test_in_motion_a_deviation_changes_cost_and_potential_alike(play: Play) -> None:
    """J_i changes by (1 - lam_i) times the change of Phi, efforts included."""
    game, before = play.game, evaluate(play.game, play.profile)
    for i, agent in enumerate(game.agents):
        rows = play.controls[i]
        for other in (rows[::-1], np.roll(rows, 1, axis=0), np.roll(rows, 2, axis=0)):
            plan = make_plan(agent, other)
            profile = tuple(plan if k == i else old for k, old in enumerate(play.profile))
            after = evaluate(game, profile)
            change = (1 - agent.lam) * (after.potential - before.potential)
            near = 1e-9 * max(1.0, abs(before.potential), abs(after.potential))
            assert after.cost[i] - before.cost[i] == pytest.approx(change, abs=near)
            shifted = after.shifted_cost[i] - before.shifted_cost[i]
            assert shifted == pytest.approx(change, abs=near)


@examples(0.25)
@given(plays_in_motion())
def test_a_step_is_no_safer_than_its_ends_and_parked_bodies_no_safer_than_none(play: Play) -> None:
    """With margins as the loss; a parked body and the time between two steps only add to it."""
    game = replace(play.game, objective="margin", margin_cap=3.0, collisions="instants")
    game = replace(game, on_goal="remove")
    base = evaluate(game, play.profile)
    swept = evaluate(replace(game, collisions="swept"), play.profile)
    for e in range(len(game.encounters)):
        steps = swept.traffic[e]
        assert (swept.margins[e][steps] <= base.margins[e][steps] + 1e-9).all()
    if play.game.on_goal == "stay":
        parked = evaluate(replace(game, on_goal="stay"), play.profile)
        assert (parked.traffic | ~base.traffic).all()
        assert (parked.deficit >= base.deficit - 1e-9).all()


def pair(**rules: str) -> Game:
    """Two unit boxes on a line that swap sides in one step, and one that stops half-way."""
    agents = (
        Agent([0.0], [4.0], Polytope.box([1.0]), Polytope.box([8.0]), noise=0.1, gain=1.0),
        Agent([4.0], [0.0], Polytope.box([1.0]), Polytope.box([8.0]), noise=0.1, gain=1.0),
    )
    return Game(agents, horizon=3, **rules)


def test_bodies_that_swap_places_touch_between_two_steps_only() -> None:
    game = pair()
    controls = [np.array([[4.0], [0], [0]]), np.array([[-4.0], [0], [0]])]
    assert evaluate(game, make_profile(game, controls)).feasible
    swept = pair(collisions="swept")
    judged = evaluate(swept, make_profile(swept, controls))
    (sentence,) = judged.violations()
    assert "between two steps" in sentence
    assert judged.residuals.overlap[0] == pytest.approx(5.0)  # 4 on one side, -4 - 1 on the other


def test_a_parked_body_is_in_the_way_with_the_errors_of_its_arrival() -> None:
    growing = {"noise": 0.25, "gain": 0.0}  # variance 0.25 t
    agents = (
        Agent([0.0], [2.0], Polytope.box([1.0]), Polytope.box([4.0]), **growing),
        Agent([9.0], [4.0], Polytope.box([1.0]), Polytope.box([4.0]), **growing),
    )
    game = Game(agents, horizon=4, margin_cap=9.0, on_goal="stay")
    profile = make_profile(game, [[[2.0], [0], [0], [0]], [[-2.0], [-2.0], [-1.0], [0]]])
    judged = evaluate(game, profile)
    assert judged.arrival == (1, 3)
    assert judged.traffic[0].tolist() == [True] * 3 + [False] * 2
    # Apart 5 - 1 at t = 1 with variance 0.5, and 3 - 1 at t = 2 with 0.25 + 0.5.
    expected = [9.0, 4 / np.sqrt(2 * 0.5), 2 / np.sqrt(2 * 0.75), 9.0, 9.0]
    np.testing.assert_allclose(judged.margins[0], expected)


def test_a_mean_too_near_its_wall_and_a_control_without_room_are_violations() -> None:
    fence = HalfSpaces.between([-1.0], [3.0], sigmas=2.0)
    runner = Agent(
        [0.0], [2.0], Polytope.box([1.0]), Polytope.box([4.0]),
        noise=0.25, gain=0.5, within=(fence,), reserve=1.0,
    )  # fmt: skip
    game = Game((runner,), horizon=2)
    slow, fast = ([[1.0], [1.0]], [[0.25], [1.75]])
    judged = evaluate(game, make_profile(game, [slow]))
    # At t = 2 the variance is 0.25/4 + 0.25: two deviations from 2 are beyond 3.
    assert judged.residuals.within[0] == pytest.approx(2 + 2 * np.sqrt(0.3125) - 3)
    assert judged.residuals.control[0] == 0
    judged = evaluate(game, make_profile(game, [fast]))
    # At t = 1 feedback asks for 0.5 e with variance 0.25: one deviation is 0.25.
    assert judged.residuals.control[0] == pytest.approx(1.75 + 0.25 - 2.0, abs=1e-12)
    tight = replace(runner, reserve=2.0)
    judged = evaluate(Game((tight,), horizon=2), make_profile(Game((tight,), horizon=2), [fast]))
    assert judged.residuals.control[0] == pytest.approx(0.25)
