"""Cores: agents that cannot all arrive early without losses, and bounds that use them."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import make_game
from ppg_env.game import objective
from ppg_env.game.earliest_way import earliest_way
from solvers import best_response_dynamics, social_optimum
from solvers.budget import Budget
from solvers.engine.symmetry import symmetries
from solvers.optimum import cores, pair_bound
from solvers.optimum.cores import CoreSearch
from tests.solvers.walled_games import walled_game


def search(game, last=5):
    weights = objective.social(game)
    first = [earliest_way(game, i) for i in range(len(game.agents))]
    later = [t + last for t in first]
    return CoreSearch(weights, symmetries(weights), first, later, Budget(None)), first


def test_plans_of_an_equilibrium_satisfy_every_core():
    game = make_game("circle(6)")
    weights, solution = objective.social(game), best_response_dynamics(game)
    cores_of_game, first = search(game)
    arrivals = [plan.arrival for plan in solution.profile]
    evaluation = solution.evaluation
    losses = np.where(evaluation.traffic, objective.loss(game, evaluation.margins), 0.0)
    losses = weights.encounter * losses.sum(axis=1)
    found = cores_of_game.violated(first, {})
    assert found
    for core in found:
        agents = {i for i, _ in core.latest}
        late = sum(arrivals[i] > t for i, t in core.latest)
        paid = sum(
            x for x, e in zip(losses, game.encounters, strict=True) if agents >= set(e.agents)
        )
        assert paid >= core.least * (1 - late) - 1e-9
        assert len(core.latest) >= 3


def test_values_fall_as_arrivals_rise():
    one, first = search(make_game("circle(6)"), last=8)
    values = [one.values.value({i: first[i] + later for i in (0, 1, 2)}) for later in range(4)]
    assert values[0] > 0
    assert (np.diff(values) <= 1e-9).all()


@pytest.mark.slow
def test_cores_raise_the_bound_on_a_crowd_and_keep_it_below_the_optimum(monkeypatch):
    game = make_game("circle(5)")
    optimum = social_optimum(game)
    bound = pair_bound.pair_bound(objective.social(game), Budget(None))
    monkeypatch.setattr(cores, "SIZES", ())
    pairs = pair_bound.pair_bound(objective.social(game), Budget(None))
    assert pairs <= bound <= optimum.value + 1e-6


def test_agents_that_stay_in_traffic_at_their_goals_have_no_cores():
    assert not search(walled_game("parked", 1))[0].values.possible
    assert search(make_game("circle(4)"))[0].values.possible
