"""Certificates: regret is an upper bound on the true gain, never negative, never for nonsense."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import InputError, evaluate, make_game, make_profile, straight_plan
from solvers import best_response, best_response_dynamics, certify, social_optimum
from solvers.equilibrium.certificate import Certificate

LIMITS = [0.0, 0.01, 0.05, 0.2, 0.5]


def delayed(game, steps):
    """Straight plans of which agent k starts ``steps * k`` steps late."""
    controls = []
    for k, agent in enumerate(game.agents):
        plan = straight_plan(agent, game.horizon)
        controls.append(np.vstack([np.zeros((steps * k, 2)), plan.controls])[: game.horizon])
    return make_profile(game, controls)


@pytest.fixture(scope="module", params=["margin", "risk"])
def bad(request):
    """A game, a poor but feasible profile of it, and what each agent could really gain."""
    game = make_game("intersection3", objective=request.param, horizon=20)
    profile = delayed(game, 5)
    judged = evaluate(game, profile)
    assert judged.feasible
    gains = [judged.shifted_cost[i] - best_response(game, i, profile).value for i in range(3)]
    return game, profile, np.array(gains)


def test_the_regret_of_a_bad_profile_is_its_true_gain(bad):
    game, profile, gains = bad
    assert gains.max() > 0.5
    proof = certify(game, profile)
    assert (proof.regret >= gains - 1e-6).all()
    np.testing.assert_allclose(proof.regret, gains, atol=1e-5)
    assert proof.epsilon == proof.regret.max()
    np.testing.assert_allclose(proof.cost, evaluate(game, profile).shifted_cost, atol=1e-9)


@pytest.mark.parametrize("limit", LIMITS)
def test_under_any_time_limit_the_regret_is_still_an_upper_bound(bad, limit):
    game, profile, gains = bad
    proof = certify(game, profile, time_limit=limit)
    assert (proof.regret >= gains - 1e-6).all()
    assert np.isfinite(proof.regret).all()


@pytest.mark.slow
def test_on_scip_too_the_regret_is_an_upper_bound_under_any_time_limit():
    pytest.importorskip("pyscipopt")
    game = make_game("intersection", speed="l1", objective="risk", gain=0.0)
    profile = delayed(game, 3)
    cost = evaluate(game, profile).shifted_cost
    gains = [cost[i] - best_response(game, i, profile).value for i in (0, 1)]
    for limit in (0.05, 0.2, 0.5):
        proof = certify(game, profile, solver="SCIP", time_limit=limit)
        assert (proof.regret >= np.array(gains) - 1e-6).all(), f"at a time limit of {limit} s"


def test_a_change_of_the_profile_by_one_agent_changes_the_others_bounds_only(bad):
    game, profile, _ = bad
    better = best_response(game, 0, profile).profile
    before, after = certify(game, profile), certify(game, better)
    assert after.regret[0] <= 1e-5
    assert after.bound[0] == pytest.approx(before.bound[0], abs=1e-5)


def test_regret_is_zero_where_the_bound_is_above_the_cost():
    proof = Certificate(np.array([1.0, 2.0]), np.array([1.0 + 1e-9, 1.5]))
    assert proof.regret.tolist() == [0.0, 0.5]
    assert proof.epsilon == 0.5


def test_both_charges_agree_where_there_is_nothing_to_pay():
    game = make_game("course")
    alone = social_optimum(game)
    for charge in ("selfish", "pigou"):
        assert certify(game, alone.profile, charge=charge).epsilon <= 1e-5


def test_overlapping_means_are_refused():
    game = make_game("head_on")
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    with pytest.raises(InputError, match="overlap"):
        certify(game, straight)


def test_a_plan_that_misses_its_goal_is_refused():
    game = make_game("parallel")
    with pytest.raises(InputError, match="misses its goal"):
        certify(game, make_profile(game, np.zeros((2, game.horizon, 2))))


def test_a_control_outside_its_set_is_refused():
    game = make_game("parallel")
    controls = [np.zeros((game.horizon, 2)) for _ in game.agents]
    for k, agent in enumerate(game.agents):
        controls[k][0] = agent.goal - agent.start
    with pytest.raises(InputError, match="leaves its set"):
        certify(game, make_profile(game, controls))


@pytest.mark.parametrize("option", [{"charge": "generous"}, {"solver": "ABACUS"}])
def test_an_option_that_does_not_exist_is_refused(option):
    game = make_game("parallel")
    profile = best_response_dynamics(game).profile
    with pytest.raises(InputError):
        certify(game, profile, **option)
