"""Many agents: symmetries, cuts, kept proofs, annealing and bounds."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from ppg_env import evaluate, make_game
from ppg_env.game import objective
from ppg_env.game.least_effort import straight_plan
from solvers import best_response_dynamics, certify, social_optimum
from solvers.budget import Budget
from solvers.engine.arrival_search import engine_search
from solvers.engine.branch_and_bound import BranchAndBound
from solvers.engine.cuts import CutPool
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.presolve import Subproblem, matters, presolve_encounters
from solvers.engine.refine import refine
from solvers.engine.symmetry import identity, symmetries
from solvers.liability import make_rule
from solvers.optimum.annealing import descent
from solvers.optimum.pair_bound import pair_bound
from solvers.solution import Status
from tests.marks import first


def crossing(**changes):
    """Four agents on a small circle, quickly solved."""
    return make_game("circle(4, radius=25)", **({"horizon": 8, "lam": 0.5} | changes))


@pytest.mark.parametrize(
    ("name", "count"),
    [("circle(4)", 8), ("circle(3)", 2), ("head_on", 4), ("intersection", 2), ("intersection3", 1)],
)
def test_games_have_their_visible_symmetries(name, count):
    game = make_game(name)
    found = symmetries(objective.social(game))
    assert found[0] == identity(game)
    assert len(found) == count


def test_a_symmetry_is_lost_with_unequal_agents_and_kept_by_none_of_them():
    game = crossing()
    first = replace(game.agents[0], lam=0.4)
    uneven = replace(game, agents=(first, *game.agents[1:]))
    assert len(symmetries(objective.social(uneven))) == 2  # the mirror through agent 0
    noisy = replace(game, agents=(replace(game.agents[0], noise=2.5), *game.agents[1:]))
    assert len(symmetries(objective.social(noisy))) == 2


def test_mirrored_profiles_cost_the_same():
    """A symmetry is what it claims: the image of any profile has the image's costs."""
    game = crossing(horizon=12)
    plans = best_response_dynamics(game).profile
    judged = evaluate(game, plans)
    for one in symmetries(objective.social(game)):
        losses = np.array([judged.margins[e].sum() for e in range(len(game.encounters))])
        pairs = [set(e.agents) for e in game.encounters]
        for e, image in enumerate(one.encounters):
            assert {one.agents[i] for i in pairs[e]} == pairs[image]
        assert sorted(one.encounters) == list(range(len(losses)))


def test_the_optimum_is_the_same_with_and_without_symmetry_and_cuts(monkeypatch):
    game = crossing()
    weights = objective.social(game)
    fast = engine_search(weights, range(4), None, Budget(None))
    monkeypatch.setattr(
        "solvers.engine.arrival_search.symmetries", lambda weights: [identity(game)]
    )
    monkeypatch.setattr("solvers.engine.cuts.PATIENCE", 0)
    eager = engine_search(weights, range(4), None, Budget(None))
    monkeypatch.setattr("solvers.engine.cuts._triples", lambda subproblem: [])
    plain = engine_search(weights, range(4), None, Budget(None))
    assert fast.status is eager.status is plain.status is Status.OPTIMAL
    assert fast.value == pytest.approx(plain.value, abs=1e-6)
    assert eager.value == pytest.approx(plain.value, abs=1e-6)


@pytest.mark.slow
def test_cuts_are_at_most_what_plans_lose():
    """The value of three movers' losses is at most that of any feasible profile of four."""
    game = crossing(gain=-0.5)
    weights = objective.social(game)
    best = engine_search(weights, range(4), None, Budget(None))
    cuts = CutPool(Subproblem(weights, (0, 1, 2, 3), {}), symmetries(weights), Budget(None))
    arrivals = dict(enumerate(best.evaluation.arrival))
    traffic = np.where(best.evaluation.traffic, game.margin_cap - best.evaluation.margins, 0.0)
    lost = weights.encounter * traffic.sum(axis=1)
    assert len(cuts.parts) == 4
    for part in cuts.parts:
        assert cuts.value(part, arrivals) <= lost[list(part)].sum() + 1e-6


def test_a_released_search_continues_where_it_stopped():
    game = crossing()
    weights = objective.social(game)
    subproblem = Subproblem(weights, (0, 1, 2, 3), {})
    arrivals = {0: 6, 1: 7, 2: 6, 3: 7}
    known = presolve_encounters(subproblem, range(len(game.encounters)), arrivals)
    assert known is not None

    def tree(budget):
        make = lambda: FixedProgram(subproblem, arrivals, known)  # noqa: E731 - short
        return BranchAndBound(make, 0.0, inf, budget, lambda p, x, estimate, spare: estimate)

    budget = Budget(None, 20)
    whole, broken = tree(Budget(None)), tree(budget)
    assert whole.search(inf)
    while broken.open_bound < inf:
        broken.search(inf)
        broken.release()
        budget.nodes += 20
    assert broken.bound == pytest.approx(whole.bound, abs=1e-6)


def test_no_agent_that_matters_is_left_out():
    """Where a straight plan loses margin to another, the reachable sets allow it."""
    game = make_game("random(6, 1)")
    straight = [straight_plan(agent, game.horizon) for agent in game.agents]
    judged = evaluate(game, tuple(straight))
    irrelevant = 0
    for e, encounter in enumerate(game.encounters):
        i, j = encounter.agents
        possible = matters(game, e, i, straight[j], game.horizon)
        loses = judged.traffic[e] & (judged.margins[e] < game.margin_cap)
        assert possible or not loses.any()
        irrelevant += not matters(game, e, i, straight[j], straight[i].arrival)
    assert irrelevant > 0


@pytest.mark.parametrize("name", first(1, ["random(7, 3)", "circle(6)"]))
def test_equilibria_with_kept_proofs_are_certified_by_new_ones(name):
    game = make_game(name)
    solution = best_response_dynamics(game)
    assert solution.status is Status.EQUILIBRIUM
    again = certify(game, solution.profile)
    assert again.epsilon <= 1e-4
    np.testing.assert_allclose(again.regret, solution.regret, atol=1e-5)


@pytest.mark.slow
def test_pigou_dynamics_lower_the_social_cost():
    game = make_game("intersection3", speed="l1", gain=0.0, margin_cap=5.0)
    selfish = best_response_dynamics(game)
    pigou = best_response_dynamics(game, charge="pigou", start=selfish.profile)
    assert pigou.evaluation.social_cost <= selfish.evaluation.social_cost + 1e-6
    assert certify(game, pigou.profile, charge="pigou").epsilon <= 1e-4


@pytest.mark.parametrize("kind", first(1, ["margin", "risk"]))
def test_refinement_never_costs_and_ends_where_faces_leave_nothing_to_gain(kind):
    game = make_game("intersection3", speed="l1", objective=kind, gain=0.0, lam=0.8)
    weights = objective.social(game)
    rough = best_response_dynamics(game, max_sweeps=1).profile
    before = evaluate(game, rough).weighted(weights)
    once = refine(weights, rough, Budget(None))
    after = evaluate(game, once).weighted(weights)
    assert after <= before + 1e-9
    assert evaluate(game, once).feasible
    twice = refine(weights, once, Budget(None))
    assert evaluate(game, twice).weighted(weights) == pytest.approx(after, abs=1e-5)


@pytest.mark.parametrize(
    "name", first(2, ["intersection3", "random(4, 2)", "circle(4, radius=25)"])
)
@pytest.mark.parametrize("lam", [0.5, 0.8])
def test_the_bound_from_pairs_is_never_above_the_optimum(name, lam):
    game = make_game(name, lam=lam, gain=0.0)
    best = social_optimum(game, time_limit=60.0)
    bound = pair_bound(objective.social(game), Budget(None))
    assert bound <= best.value + 1e-6
    assert bound >= sum(agent.lam for agent in game.agents)  # it says something


@pytest.mark.slow
def test_descent_betters_best_responses_and_repeats_itself():
    game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
    best = social_optimum(game)
    values = []
    budgets = [Budget(None, 4000) for _ in range(2)]
    profiles = [
        descent(make_rule(game, "pigou"), "ENGINE", budget, 5, values.append) for budget in budgets
    ]
    assert profiles[0].profile == profiles[1].profile
    assert values == sorted(values[: len(values) // 2], reverse=True) * 2
    assert best.value - 1e-6 <= values[-1] < values[0]


def test_many_agents_get_plans_a_bound_and_the_truth_about_the_gap():
    reported = []
    game = make_game("circle(6)")
    solution = social_optimum(game, node_limit=600, progress=lambda *news: reported.append(news))
    assert solution.evaluation.feasible
    assert solution.bound <= solution.value + 1e-6
    assert solution.status in (Status.FEASIBLE, Status.OPTIMAL)
    assert solution.status is Status.OPTIMAL or "the gap is proved" in solution.advice
    assert {what for what, _ in reported} == {"value", "bound"}


@pytest.mark.slow
def test_a_limit_on_nodes_gives_the_same_answer_everywhere():
    game = crossing(gain=-0.5)
    first, again = (social_optimum(game, node_limit=150) for _ in range(2))
    assert (first.value, first.bound, first.profile) == (again.value, again.bound, again.profile)
    whole = social_optimum(game)
    assert first.bound <= whole.value + 1e-6
    assert first.value >= whole.value - 1e-6
