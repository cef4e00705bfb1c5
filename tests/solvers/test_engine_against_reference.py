"""The engine against the paper's formulation on other back ends: best responses, joint optima."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import pytest

from ppg_env import evaluate, make_game
from ppg_env.game import objective
from ppg_env.game.least_effort import straight_plan
from ppg_env.scenarios.make import SPEEDS
from solvers import Status, best_response, social_optimum
from solvers.budget import Budget
from solvers.dispatch import ENGINE, minimise
from tests.marks import first, slow_if
from tests.oracles.mixed_games import FLAT, mixed_game
from tests.oracles.random_games import drawn_plan, random_game

PAPER = ("head_on", "intersection", "opposing", "parallel", "intersection3")
KINDS = ("margin", "risk")
MOTIONS = (("swept", "stay"), ("swept", "remove"), ("instants", "stay"))
"""What collisions are, and what arrived bodies do, other than in the paper."""


LONG = {83}
"""Seeds of mixed games in motion whose best responses take the reference minutes."""

SOLVED = [seed for seed in FLAT if seed not in LONG][:100]
QUICK = {11, 16, 17, 27}

SPACE = [0, 2, 3, 7, 18, 26, 29, 33, 52, 55]
"""Seeds of mixed games in space that the reference solves within a minute."""

HARD = {6}
"""Seeds whose joint optima take minutes."""


def moving(name, motion, **changes):
    """The scenario with other rules of collisions and goals."""
    collisions, on_goal = motion
    return replace(make_game(name, **changes), collisions=collisions, on_goal=on_goal)


def assert_agree(weights, movers, given):
    """Both find the same status, value and bound."""
    engine, reference = (
        minimise(weights, movers, given, solver, Budget(None)) for solver in (ENGINE, "HIGHS")
    )
    assert engine.status is reference.status
    if engine.profile is not None:
        value = reference.value
        near = pytest.approx(value, rel=1e-6, abs=1e-6)
        assert engine.value == near
        assert engine.bound == near
        assert engine.bound <= value + 1e-7 * max(1.0, abs(value))


@pytest.mark.parametrize("name", first(1, PAPER))
@pytest.mark.parametrize("speed", slow_if(lambda speed: speed != "box", SPEEDS))
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("lam", "gain"), [(0.2, 0.5), (0.8, 0.0)])
def test_best_responses_agree_with_the_reference(name, speed, kind, lam, gain):
    game = make_game(name, speed=speed, objective=kind, lam=lam, gain=gain)
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    assert_agree(objective.selfish(game, 0), (0,), straight)


@pytest.mark.slow
@pytest.mark.parametrize("name", first(1, PAPER[:4]))
@pytest.mark.parametrize("speed", first(1, ["l1", "box"]))
@pytest.mark.parametrize("kind", first(1, KINDS))
def test_joint_optima_agree_with_the_reference(name, speed, kind):
    game = make_game(name, speed=speed, objective=kind, lam=0.8)
    for weights in (objective.social(game), objective.potential(game)):
        assert_agree(weights, (0, 1), None)


@pytest.mark.slow
def test_obstacles_and_three_dimensions_agree_with_the_reference():
    for name in ("course", "intersection_3d"):
        game = make_game(name, objective="risk", lam=0.7)
        straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
        assert_agree(objective.selfish(game, 0), (0,), straight)


@pytest.mark.parametrize("seed", first(5, range(100, 200)))
def test_random_games_agree_with_the_reference(seed):
    game, random = random_game(seed)
    plans = [
        next((plan for _ in range(200) if (plan := drawn_plan(agent, random))), None)
        for agent in game.agents
    ]
    if None in plans:
        pytest.skip("no plan was drawn for one of the agents")
    assert_agree(objective.selfish(game, 0), (0,), tuple(plans))
    if len(game.agents) == 2:
        assert_agree(objective.social(game), (0, 1), None)


@pytest.mark.parametrize("seed", first(2, range(20)))
def test_all_programs_of_mixed_games_agree_with_the_reference(seed):
    mixed = mixed_game(seed)
    game = mixed.game
    for i in range(2):
        assert_agree(objective.selfish(game, i), (i,), mixed.profile)
    if game.dim < 3:  # the reference may take minutes in space
        for weights in (objective.social(game), objective.potential(game)):
            assert_agree(weights, (0, 1), None)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 4, 5])
def test_mixed_games_of_three_agents_agree_with_the_reference(seed):
    game = mixed_game(seed, 3).game
    for weights in (objective.social(game), objective.potential(game)):
        assert_agree(weights, range(3), None)


@pytest.mark.nightly
@pytest.mark.parametrize("name", first(1, PAPER))
@pytest.mark.parametrize("motion", first(1, MOTIONS))
@pytest.mark.parametrize("kind", first(1, KINDS))
@pytest.mark.parametrize("speed", first(1, ["l1", "box"]))
def test_best_responses_in_motion_agree_with_the_reference(name, motion, kind, speed):
    game = moving(name, motion, speed=speed, objective=kind, lam=0.8 if speed == "l1" else 0.2)
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    assert_agree(objective.selfish(game, 0), (0,), straight)


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("name", ["course", "corridor", "intersection_3d", "circle(4)"])
@pytest.mark.parametrize("motion", MOTIONS)
def test_best_responses_among_obstacles_and_crowds_in_motion_agree(name, motion):
    game = moving(name, motion, lam=0.8)
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    assert_agree(objective.selfish(game, 0), (0,), straight)


@pytest.mark.nightly
@pytest.mark.parametrize("name", first(0, PAPER[:4]))
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("kind", KINDS)
def test_joint_optima_in_motion_agree_with_the_reference(name, motion, kind):
    game = moving(name, motion, speed="l1", objective=kind, lam=0.8)
    for weights in (objective.social(game), objective.potential(game)):
        assert_agree(weights, (0, 1), None)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", slow_if(lambda seed: seed not in QUICK, [*SOLVED, *SPACE]))
def test_random_games_in_motion_agree_with_the_reference(seed):
    mixed = mixed_game(seed, in_motion=True)
    game = mixed.game
    assert_agree(objective.selfish(game, seed % 2), (seed % 2,), mixed.profile)
    if seed % 3 == 0 and seed not in HARD and game.dim < 3:
        weights = objective.social(game) if seed % 2 else objective.potential(game)
        assert_agree(weights, (0, 1), None)


OTHERS = {"SCIP": "pyscipopt", "GUROBI": "gurobipy"}
TOO_LARGE = "too large for the size-limited licence of Gurobi"


@cache
def on_the_engine(game):
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    return straight, social_optimum(game), best_response(game, 0, straight)


def costly(case):
    """Risk with the L1 ball takes SCIP longest."""
    return case[0] != "head_on" or case[1:] == ("l1", "risk")


@pytest.mark.parametrize("case", slow_if(costly, product(PAPER[:4], ("box", "l1"), KINDS)), ids=str)
@pytest.mark.parametrize("solver", OTHERS)
def test_planners_agree_with_other_back_ends(solver, case):
    pytest.importorskip(OTHERS[solver])
    name, speed, kind = case
    game = make_game(name, objective=kind, speed=speed)
    straight, social, response = on_the_engine(game)
    other = social_optimum(game, solver=solver)
    if solver == "GUROBI" and other.status is Status.ERROR:
        pytest.skip(TOO_LARGE)
    assert other.status is Status.OPTIMAL
    assert other.value == pytest.approx(social.value, rel=1e-6)
    assert other.bound == pytest.approx(social.bound, rel=1e-6)
    there = best_response(game, 0, straight, solver=solver)
    assert there.value == pytest.approx(response.value, rel=1e-6)
    assert evaluate(game, there.profile).violations((0,)) == ()


def test_three_agents_have_one_optimum_on_scip():
    pytest.importorskip("pyscipopt")
    game = make_game("intersection3")
    assert social_optimum(game, solver="scip").value == pytest.approx(
        social_optimum(game).value, rel=1e-6
    )


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("motion", first(1, MOTIONS))
@pytest.mark.parametrize("name", first(1, ["head_on", "intersection"]))
def test_plans_in_motion_agree_with_scip(name, motion):
    pytest.importorskip("pyscipopt")
    game = moving(name, motion, speed="l1", lam=0.8)
    straight, social, response = on_the_engine(game)
    there = best_response(game, 0, straight, solver="scip")
    assert there.value == pytest.approx(response.value, rel=1e-6)
    assert there.bound == pytest.approx(response.bound, rel=1e-6)
    assert social_optimum(game, solver="scip").value == pytest.approx(social.value, rel=1e-6)


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("seed", FLAT[:30:3])
def test_random_games_in_motion_agree_with_scip(seed):
    pytest.importorskip("pyscipopt")
    mixed = mixed_game(seed, in_motion=True)
    engine, other = (
        best_response(mixed.game, 0, mixed.profile, solver=solver) for solver in ("ENGINE", "SCIP")
    )
    assert other.status is engine.status
    if engine.profile is not None:
        assert other.value == pytest.approx(engine.value, rel=1e-6, abs=1e-6)
