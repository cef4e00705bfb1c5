"""The compiled program itself: its means, its objective, its big-M, and its re-use."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import evaluate, make_game, make_plan, make_profile, straight_plan
from ppg_env.game import objective
from solvers.reference import cvxpy_backend as backend
from solvers.reference.formulation import Program
from tests.marks import first

PAPER = ("opposing", "head_on", "parallel", "intersection", "intersection3")


def solved(weights, movers, given=None):
    program = Program(weights, movers)
    program.update(given)
    answer = backend.solve(program.problem, "HIGHS", None)
    assert answer.outcome == "optimal"
    return program


@pytest.mark.parametrize("name", first(1, PAPER))
@pytest.mark.parametrize("gain", [0.0, 0.5])
@pytest.mark.parametrize("goal", ["margin", "risk"])
def test_a_replay_of_the_controls_reproduces_the_programs_means(name, gain, goal):
    game = make_game(name, objective=goal, gain=gain)
    program = solved(objective.social(game), range(len(game.agents)))
    for i, mover in program.movers.items():
        plan = make_plan(game.agents[i], mover.controls.value)
        until = plan.arrival + 1
        np.testing.assert_allclose(mover.means.value[:until], plan.means[:until], atol=1e-6)
        assert mover.arrival.value[plan.arrival] == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("name", first(1, PAPER))
@pytest.mark.parametrize("speed", ["box", "l1"])
def test_the_margin_programs_own_optimum_is_the_evaluators_cost(name, speed):
    game = make_game(name, objective="margin", speed=speed)
    weights = objective.potential(game)
    program = solved(weights, range(len(game.agents)))
    profile = make_profile(game, [mover.controls.value for mover in program.movers.values()])
    judged = evaluate(game, profile)
    assert judged.feasible
    assert program.problem.value == pytest.approx(judged.weighted(weights), abs=1e-6)


@pytest.mark.parametrize("name", PAPER)
def test_the_risk_programs_own_optimum_is_below_the_evaluators_cost(name):
    game = make_game(name, objective="risk")
    weights = objective.social(game)
    program = solved(weights, range(len(game.agents)))
    profile = make_profile(game, [mover.controls.value for mover in program.movers.values()])
    assert program.problem.value <= evaluate(game, profile).weighted(weights) + 1e-6


@pytest.mark.parametrize("name", PAPER)
@pytest.mark.parametrize("speed", ["box", "l1", "disc"])
def test_big_m_never_cuts_off_a_plan_that_reaches_its_goal(name, speed):
    # Any plan must satisfy  clear >= unit cap - M  on every face that it does not choose.
    game = make_game(name, speed=speed, horizon=17)
    profile = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    program = Program(objective.social(game), range(len(game.agents)))
    program.update(None)
    for part in program.separations:
        i, j = part.encounter.agents
        (rows,) = part.rows
        until = min(profile[i].arrival, profile[j].arrival)
        apart = profile[i].means[:until] - profile[j].means[:until]
        clear = apart @ part.encounter.collision.normals.T - part.encounter.collision.offsets
        needed = rows.units.value[:until] * game.margin_cap - rows.big.value[:until]
        assert (clear >= needed - 1e-6).all()
        assert (part.possible_faces[:until][clear >= 0] == 1).all()


@pytest.mark.slow
def test_a_recompiled_and_a_reused_program_find_one_optimum():
    game = make_game("intersection", speed="l1")
    weights = objective.selfish(game, 0)
    straight = [straight_plan(agent, game.horizon) for agent in game.agents]
    late = make_plan(game.agents[1], np.vstack([np.zeros((2, 2)), straight[1].controls[:-2]]))
    reused = Program(weights, (0,))
    for other in (straight[1], late, straight[1]):
        given = (straight[0], other)
        reused.update(given)
        assert backend.solve(reused.problem, "HIGHS", None).outcome == "optimal"
        fresh = solved(weights, (0,), given)
        assert reused.problem.value == pytest.approx(fresh.problem.value, abs=1e-6)


def test_a_pair_has_one_set_of_faces_and_the_program_follows_dpp():
    game = make_game("intersection3")
    program = Program(objective.social(game), range(3))
    assert len(program.separations) == 3
    assert Program(objective.selfish(game, 1), (1,)).problem.is_dcp(dpp=True)
    assert program.problem.is_dcp(dpp=True)
