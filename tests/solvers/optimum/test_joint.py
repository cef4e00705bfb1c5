"""The potential program and the social optimum: equilibrium, fact 3 (Pigou) and fact 4."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import make_game
from solvers import certify, potential_equilibrium, social_optimum
from solvers.solution import Status
from tests.marks import first


def test_the_potential_minimiser_is_a_nash_equilibrium(paper_game, potential):
    assert potential.status is Status.OPTIMAL
    assert potential.regret.shape == (len(paper_game.agents),)
    assert potential.regret.min() >= 0
    assert potential.regret.max() <= 1e-5


def test_with_safety_counted_twice_the_social_optimum_is_an_equilibrium(paper_game, social):
    proof = certify(paper_game, social.profile, charge="pigou")
    assert proof.epsilon <= 1e-4
    assert (proof.regret >= 0).all()
    assert (proof.bound >= 0).all()


def test_no_equilibrium_has_a_lower_potential(potential, nash):
    assert nash.evaluation.potential >= potential.value - 1e-5


def doubled(lam):
    """The weight at which a planner cares half as much for safety: odds 2 lam / (1 - lam)."""
    return 2 * lam / (1 + lam)


@pytest.mark.parametrize("lam", first(1, [0.5, 0.1, 0.8]))
@pytest.mark.parametrize(
    ("name", "speed", "objective"),
    [
        ("intersection", "l1", "margin"),
        ("opposing", "disc", "margin"),
        ("parallel", "l1", "risk"),
        ("intersection3", "box", "risk"),
    ],
)
def test_the_best_equilibrium_is_the_optimum_of_a_planner_who_cares_half_as_much(
    lam, name, speed, objective
):
    # Phi(lam) = a sum T + P with a = lam/(1 - lam) and P the pairs' losses, each once.
    # S(mu) = mu sum T + 2 (1 - mu) P = 2 (1 - mu) [a sum T + P] when mu/(1 - mu) = 2 a.
    mu = doubled(lam)
    assert mu / (1 - mu) == pytest.approx(2 * lam / (1 - lam))
    selfish = potential_equilibrium(make_game(name, speed=speed, objective=objective, lam=lam))
    planner = social_optimum(make_game(name, speed=speed, objective=objective, lam=mu))
    assert selfish.value > 0
    assert 2 * (1 - mu) * selfish.value == pytest.approx(planner.value, rel=1e-5)


@pytest.mark.slow
def test_no_other_weight_of_the_planner_gives_the_same_value():
    # So that the factor above is tested where it matters: losses are not zero here.
    game = make_game("head_on", speed="l1", lam=0.5, gain=0.0)
    selfish = potential_equilibrium(game)
    assert selfish.evaluation.deficit.sum() > 0.1
    for mu in (0.5, 0.75):
        planner = social_optimum(make_game("head_on", speed="l1", lam=mu, gain=0.0))
        assert 2 * (1 - mu) * selfish.value != pytest.approx(planner.value, rel=1e-3)


def test_the_price_of_stability_is_at_most_two(potential, social):
    # On shifted costs, which are positive: SC(argmin Phi) <= 2 (1 - lam) Phi* <= 2 SC*.
    assert social.bound > 0
    assert potential.evaluation.social_cost <= 2 * social.bound + 1e-6


def test_the_price_of_stability_is_at_most_two_where_selfishness_costs_something():
    game = make_game("intersection", speed="l1", lam=0.8, noise=4.0, margin_cap=5.0)
    selfish, planner = potential_equilibrium(game), social_optimum(game)
    assert 1.01 < selfish.evaluation.social_cost / planner.value <= 2


def test_in_a_hurry_the_equilibrium_costs_a_little_more_and_is_far_riskier_than_the_optimum():
    # The paper's headline, on head_on with the L1 ball.
    game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
    social = social_optimum(game)
    assert certify(game, social.profile).epsilon > 1e-2
    equilibrium = potential_equilibrium(game).evaluation
    assert 1.01 < equilibrium.social_cost / social.value < 1.1
    assert equilibrium.risk_bound_any > 100 * social.evaluation.risk_bound_any


@pytest.mark.parametrize("lam", [[0.1, 0.9], [0.0, 0.5]])
def test_unequal_lams_have_a_weighted_potential_whose_minimum_is_an_equilibrium(lam):
    game = make_game("intersection", speed="l1", lam=lam)
    assert potential_equilibrium(game).regret.max() <= 1e-5
    assert certify(game, social_optimum(game).profile, charge="pigou").epsilon <= 1e-4


@pytest.mark.parametrize("planner", [potential_equilibrium, social_optimum])
def test_a_goal_out_of_reach_is_a_status_with_advice(planner):
    solution = planner(make_game("intersection3", horizon=6))
    assert solution.status is Status.UNREACHABLE
    assert solution.profile is None
    assert solution.evaluation is None
    assert "horizon" in solution.advice
    assert not np.isfinite(solution.value)


@pytest.mark.parametrize("planner", [potential_equilibrium, social_optimum])
def test_bodies_that_must_overlap_are_infeasible_with_advice(planner):
    # Both have exactly the time they need, straight through each other.
    solution = planner(make_game("head_on", speed="l1", horizon=9))
    assert solution.status is Status.INFEASIBLE
    assert solution.profile is None
    assert "overlap" in solution.advice
