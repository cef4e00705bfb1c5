"""The four facts of the games, with swept collisions, parked bodies, efforts and reserves.

1. The game has a potential: a deviation changes it by the change of the own cost / (1 - lam_i).
2. The minimiser of the potential is an equilibrium.
3. If each agent also pays for the harm to the other, the social optimum is an equilibrium.
4. With equal lam and shifted costs, the price of stability is at most 2.

Losses stay symmetric in the pair; workspaces and reserves bind an agent's own plan alone; efforts
are private, like time, so all four facts hold with them.  One corollary of the fourth does not
carry over as it stands: without obstacles the minimiser of the potential is the social optimum of a
game with 2 lam/(1 + lam) in place of lam, and effort has to be scaled in the same proportion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env import evaluate, make_game
from ppg_env.game import objective
from solvers import (
    Status,
    best_response,
    best_response_dynamics,
    certify,
    potential_equilibrium,
    social_optimum,
)
from tests.marks import first
from tests.oracles.mixed_games import mixed_game
from tests.profiles import examples

SEEDS = [19, 11, 16, 17, 12, 14, 60, 63, 69, 1, 27, 51, 75, 78, 81, 84, 87]
"""Seeds of mixed games in motion that have feasible profiles."""

MOTIONS = (("swept", "stay"), ("instants", "stay"), ("swept", "remove"))


def with_equal(game, lam):
    return replace(game, agents=tuple(replace(agent, lam=lam) for agent in game.agents))


@pytest.mark.nightly
@pytest.mark.parametrize("seed", first(4, SEEDS))
def test_a_best_response_lowers_the_potential_by_its_gain(seed):
    mixed = mixed_game(seed, in_motion=True)
    game, before = mixed.game, evaluate(mixed.game, mixed.profile)
    for i, agent in enumerate(game.agents):
        response = best_response(game, i, mixed.profile)
        if response.profile is None or not np.isfinite(before.potential):
            continue
        gain = before.shifted_cost[i] - response.evaluation.shifted_cost[i]
        fall = before.potential - response.evaluation.potential
        near = 1e-9 * max(1.0, abs(before.potential))
        assert gain == pytest.approx((1 - agent.lam) * fall, abs=near)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", first(4, SEEDS))
def test_the_minimiser_of_the_potential_is_an_equilibrium_in_motion(seed):
    game = mixed_game(seed, in_motion=True).game
    solution = potential_equilibrium(game)
    assert solution.status is Status.OPTIMAL
    assert certify(game, solution.profile).epsilon <= 1e-4


@pytest.mark.nightly
@pytest.mark.parametrize("seed", first(4, SEEDS))
def test_pigou_makes_the_social_optimum_an_equilibrium_in_motion(seed):
    game = mixed_game(seed, in_motion=True).game
    optimum = social_optimum(game)
    assert optimum.status is Status.OPTIMAL
    assert certify(game, optimum.profile, charge="pigou").epsilon <= 1e-4


@pytest.mark.nightly
@pytest.mark.parametrize("seed", first(4, SEEDS))
@pytest.mark.parametrize("lam", first(1, [0.5, 0.2]))
def test_the_price_of_stability_is_at_most_two_in_motion(seed, lam):
    game = with_equal(mixed_game(seed, in_motion=True).game, lam)
    optimum, stable = social_optimum(game), potential_equilibrium(game)
    assert stable.regret.max() <= 1e-4
    assert optimum.bound - 1e-6 <= stable.evaluation.social_cost
    assert stable.evaluation.social_cost <= 2 * optimum.value + 1e-6


@examples(0.25)
@given(
    st.floats(0, 0.95),
    st.lists(st.floats(0, 2), min_size=3, max_size=3),
    st.sampled_from(["instants", "swept"]),
    st.sampled_from(["remove", "stay"]),
)
def test_potential_and_half_the_social_cost_bound_each_other(lam, works, collisions, on_goal):
    """Time and effort count once in both, pairs once and twice: hence the price of two."""
    game = with_efforts(make_game("intersection3", lam=lam), works, 1.0)
    game = replace(game, collisions=collisions, on_goal=on_goal)
    social, potential = objective.social(game), objective.potential(game)
    for name in ("time", "encounter", "effort"):
        least = (1 - lam) * getattr(potential, name)
        assert (least <= getattr(social, name) + 1e-12).all()
        assert (getattr(social, name) <= 2 * least + 1e-12).all()


def with_efforts(game, works, share):
    """The game with these efforts, all times a share."""
    agents = zip(game.agents, works, strict=True)
    return replace(game, agents=tuple(replace(a, effort=share * w) for a, w in agents))


@examples(0.25)
@given(st.floats(0.01, 0.95), st.lists(st.floats(0.01, 2), min_size=3, max_size=3))
def test_a_selfish_society_is_one_of_planners_with_other_lam_and_effort(lam, works):
    """Phi at (lam, w) is the social cost at (lam', w') up to a factor, with lam'/lam = w'/w."""
    share = 2 / (1 + lam)
    game = with_efforts(make_game("intersection3", lam=lam), works, 1.0)
    planners = with_efforts(make_game("intersection3", lam=share * lam), works, share)
    potential, social = objective.potential(game), objective.social(planners)
    factor = 2 * (1 - share * lam)
    for name in ("time", "encounter", "effort"):
        one, other = getattr(social, name), factor * getattr(potential, name)
        np.testing.assert_allclose(one, other, rtol=1e-9)
    unscaled = objective.social(with_efforts(planners, works, 1.0))
    assert not np.allclose(unscaled.effort, factor * potential.effort, rtol=1e-3)


@pytest.mark.nightly
@pytest.mark.parametrize("motion", first(1, MOTIONS))
def test_a_selfish_society_plans_as_one_that_cares_half_as_much(motion):
    lam, works = 0.6, [0.01, 0.03]
    share = 2 / (1 + lam)
    rules = dict(zip(("collisions", "on_goal"), motion, strict=True))
    one, other = (
        replace(with_efforts(make_game("head_on", speed="l1", lam=k * lam), works, k), **rules)
        for k in (1.0, share)
    )
    least = potential_equilibrium(one)
    assert social_optimum(other).value == pytest.approx(2 * (1 - share * lam) * least.value)


@pytest.mark.parametrize("motion", MOTIONS)
def test_one_at_a_time_updates_never_raise_the_potential_in_motion(motion):
    rules = dict(zip(("collisions", "on_goal"), motion, strict=True))
    game = with_efforts(make_game("head_on", speed="l1", lam=[0.8, 0.6]), [0.01, 0.02], 1.0)
    solution = best_response_dynamics(replace(game, **rules))
    assert solution.status is Status.EQUILIBRIUM
    assert solution.regret.max() <= 1e-4
    heights = [update.potential for update in solution.trace if np.isfinite(update.potential)]
    assert (np.diff(heights) <= 1e-9).all()
