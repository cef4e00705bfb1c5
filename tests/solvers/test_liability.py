"""Rules of liability: shares, potentials where there are any, and the equilibria they lead to."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env import InputError, Polytope, evaluate, make_game, straight_plan
from ppg_env.game import objective
from solvers import best_response, best_response_dynamics, certify, social_optimum
from solvers.liability import make_rule
from solvers.solution import Status
from tests.marks import first
from tests.oracles.brute_force import Line, best_response_value

LAMS = st.lists(st.sampled_from([0.0, 0.25, 0.5, 0.9]), min_size=3, max_size=3)
SHARES = st.floats(0.0625, 0.9375)
ONCE = ("selfish", "right-of-way", "right-of-way:2-0-1")
"""Rules under which all harm is paid exactly once."""


def walled(lam):
    """Three agents and a wall."""
    wall = Polytope.from_vertices([[30, 0], [38, 0], [38, 20], [30, 20]])
    return make_game("intersection3", lam=lam, obstacles=[wall])


def same(one, other):
    np.testing.assert_allclose(one.time, other.time, rtol=1e-12)
    np.testing.assert_allclose(one.encounter, other.encounter, rtol=1e-12)


@given(LAMS)
def test_a_share_of_nothing_is_selfish_and_a_share_of_one_is_pigou(lam):
    game = walled(lam)
    for name, share in (("selfish", 0), ("pigou", 1)):
        named, partial = make_rule(game, name), make_rule(game, f"partial:{share}")
        for i in range(3):
            same(named.costs[i], partial.costs[i])
        same(named.potential, partial.potential)
    for i in range(3):
        same(make_rule(game, "selfish").costs[i], objective.selfish(game, i))
    same(make_rule(game, "selfish").potential, objective.potential(game))
    same(make_rule(game, "pigou").potential, objective.social(game))


@given(LAMS, st.sampled_from(ONCE))
def test_charges_that_pay_all_harm_once_add_up_to_the_social_cost(lam, charge):
    game = walled(lam)
    rule, social = make_rule(game, charge), objective.social(game)
    paid = [rule.costs[i] for i in range(3)]
    np.testing.assert_allclose(sum(w.encounter for w in paid), social.encounter, rtol=1e-12)
    np.testing.assert_allclose(sum(w.time for w in paid), social.time, rtol=1e-12)


@given(LAMS, SHARES)
def test_a_partial_rule_has_a_potential_unless_three_lams_differ(lam, share):
    """What changes with i's plan alone must enter its charge and the potential in one ratio."""
    game = walled(lam)
    rule = make_rule(game, f"partial:{share}")
    assert (rule.potential is None) == (len(set(lam)) == 3)
    if rule.potential is None:
        return
    for i in range(3):
        mine = rule.costs[i]
        own = mine.encounter > 0
        ratios = rule.potential.encounter[own] / mine.encounter[own]
        np.testing.assert_allclose(ratios, ratios[0], rtol=1e-9)
        assert rule.potential.time[i] == pytest.approx(ratios[0] * mine.time[i], rel=1e-9)


def test_with_equal_lam_a_partial_potential_counts_each_pair_once_and_a_share():
    game = walled([0.8, 0.8, 0.8])
    partial, social = make_rule(game, "partial:0.5").potential, objective.social(game)
    pairs = np.array([len(e.agents) == 2 for e in game.encounters])
    np.testing.assert_allclose(partial.time, social.time)
    np.testing.assert_allclose(partial.encounter[pairs], social.encounter[pairs] * 1.5 / 2)
    np.testing.assert_allclose(partial.encounter[~pairs], social.encounter[~pairs])


def test_who_has_the_way_pays_nothing_and_there_is_no_potential():
    game = walled([0.2, 0.5, 0.8])
    rule = make_rule(game, "right-of-way:2-0-1")
    by_pair = {e.agents: k for k, e in enumerate(game.encounters)}
    first, last = rule.costs[2], rule.costs[1]
    assert first.encounter[by_pair[0, 2]] == first.encounter[by_pair[1, 2]] == 0
    assert first.encounter[by_pair[2,]] == pytest.approx(0.2)  # the wall is its own affair
    assert last.encounter[by_pair[1, 2]] == pytest.approx(0.5 + 0.2)
    assert last.encounter[by_pair[0, 1]] == pytest.approx(0.8 + 0.5)
    assert rule.potential is None


@pytest.mark.slow
@pytest.mark.parametrize("kind", first(1, ["margin", "risk"]))
def test_right_of_way_is_two_best_responses_one_after_the_other(kind):
    game = make_game("head_on", speed="l1", objective=kind, lam=[0.8, 0.6], gain=0.0)
    for leader, charge in ((0, "right-of-way"), (1, "right-of-way:1-0")):
        solution = best_response_dynamics(game, charge=charge)
        assert solution.status is Status.EQUILIBRIUM
        second = 1 - leader
        fastest = straight_plan(game.agents[leader], game.horizon).arrival
        assert solution.evaluation.arrival[leader] == fastest
        other = best_response(game, second, solution.profile, charge="pigou", solver="HIGHS")
        proof = certify(game, solution.profile, charge=charge)
        assert proof.cost[leader] == pytest.approx(game.agents[leader].lam * fastest)
        assert proof.cost[second] == pytest.approx(other.value, abs=1e-5)
        assert proof.epsilon <= 1e-5
        assert proof.cost.sum() == pytest.approx(solution.evaluation.social_cost)


@pytest.mark.parametrize("lam", [(0.0, 0.4), (0.5, 0.8), (0.9, 0.9)])
@pytest.mark.parametrize("charge", ["right-of-way", "partial:0.5"])
def test_what_each_pays_on_a_line_agrees_with_dynamic_programming(charge, lam):
    line = Line(starts=(0, 8), goals=(6, 4), limits=(2, 1), horizon=7, lam=lam)
    solution = best_response_dynamics(line.game, charge=charge)
    assert solution.status is Status.EQUILIBRIUM
    proof = certify(line.game, solution.profile, charge=charge)
    for i in (0, 1):
        mine, yours = 1 - lam[i], 1 - lam[1 - i]
        care = i * (mine + yours) if charge == "right-of-way" else mine + yours / 2
        plan = solution.profile[1 - i]
        path = [float(x) for x in np.round(plan.means[:, 0], 9)]
        path[plan.arrival :] = [float(line.goals[1 - i])] * (line.horizon + 1 - plan.arrival)
        assert proof.cost[i] <= best_response_value(line, i, path, 1 / 8, care) + 1e-6


@pytest.mark.parametrize("solver", ["ENGINE", "HIGHS"])
def test_who_has_the_way_must_still_not_fly_through_others(solver):
    game = make_game("head_on", speed="l1")
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    found = best_response(game, 0, straight, charge="right-of-way", solver=solver)
    assert found.status is Status.OPTIMAL
    assert found.evaluation.feasible
    assert evaluate(game, straight).violations()
    assert found.value == pytest.approx(0.5 * found.evaluation.arrival[0])
    way = 85 + 2 * 15  # to the goal, and a body's width aside and back
    assert found.evaluation.arrival[0] == -(-way // 10)
    assert found.minimised == "charge[0]"


@pytest.mark.slow
@pytest.mark.parametrize("charge", first(1, ["partial:0.5", "right-of-way", "right-of-way:2-1-0"]))
def test_without_a_potential_there_is_still_a_certified_end(charge):
    game = make_game("intersection3", speed="l1", objective="risk", gain=0.1, lam=[0.5, 0.7, 0.9])
    solution = best_response_dynamics(game, charge=charge, start="sequential")
    assert solution.status is Status.EQUILIBRIUM
    assert np.isnan(solution.trace[-1].potential)
    again = certify(game, solution.profile, charge=charge)
    assert again.epsilon <= 1e-5
    np.testing.assert_allclose(again.regret, solution.regret, atol=1e-5)
    assert certify(game, solution.profile).epsilon > 1e-4  # selfish, they would do otherwise


@pytest.mark.slow
def test_the_potential_of_a_partial_rule_falls_and_the_optimum_is_pigous_equilibrium():
    game = make_game("intersection3", speed="l1", objective="risk", gain=0.0, lam=[0.5, 0.9, 0.5])
    partial = best_response_dynamics(game, charge="partial:0.5")
    heights = [update.potential for update in partial.trace if np.isfinite(update.potential)]
    assert len(heights) >= 2
    assert (np.diff(heights) <= 1e-9).all()
    optimum = social_optimum(game)
    assert certify(game, optimum.profile, charge="pigou").epsilon <= 1e-4
    assert certify(game, optimum.profile, charge="partial:1").epsilon <= 1e-4


@pytest.mark.parametrize(
    "charge",
    ["generous", "partial", "partial:2", "partial:nan", "partial:-0.1", "pigou:1", "selfish:"]
    + [f"right-of-way:{order}" for order in ("0", "0-0", "1-2", "0,1", "x-y")],
)
def test_a_rule_that_does_not_exist_is_refused(charge):
    with pytest.raises(InputError, match="charge"):
        best_response_dynamics(make_game("head_on"), charge=charge)
