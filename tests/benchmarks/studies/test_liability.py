"""The liability lab: rules and societies in its cells, gaps and restored optima from rows."""

from __future__ import annotations

from math import inf

import pytest

from benchmarks.studies.liability import data, study
from ppg_env.formats.game_file import game_from_tables
from ppg_env.game.plan import make_profile
from solvers import certify
from tests.benchmarks.studies.conftest import SMALL, crashing


def row(rule, cost, risk=0.1, **others):
    known = {"player": "nash", "status": "equilibrium", "rule": rule, "social_cost": cost}
    game = {"scenario": "toy", "speed": "l1", "agents": 2, "lam": 0.5, "lams": [0.5, 0.5]}
    return crashing(0.9 * risk, risk, 1.1 * risk, **known | game | others)


def optimum(cost, risk=0.01):
    return row(None, cost, risk, player="social", status="optimal")


def test_every_rule_runs_in_both_orders_and_right_of_way_follows_them():
    cells = data.cells(SMALL)
    assert len(cells) == len(data.SOCIETIES) * (2 * len(data.RULES) + 1)
    assert len({cell.address for cell in cells}) == len(cells)
    ways = {(cell.order, cell.charge) for cell in cells if "way" in cell.charge}
    assert ways == {((0, 1), "right-of-way:0-1"), ((1, 0), "right-of-way:1-0")}
    lams = {tuple(agent.lam for agent in cell.game.agents) for cell in cells}
    assert lams == {(0.8, 0.8), (0.65, 0.95)}


@pytest.mark.slow
def test_costs_and_regrets_of_rows_are_those_of_their_rules(whole):
    for stored in whole(study.STUDY):
        known = data.digest(stored)
        if known["rule"] is None:
            assert known["status"] == "optimal"
            continue
        assert known["rule"] in data.RULES
        game = game_from_tables(stored.game, "row")
        proof = certify(game, make_profile(game, stored.controls), charge=stored.charge)
        assert known["regret"] == pytest.approx(proof.epsilon, abs=1e-5)


@pytest.mark.slow
def test_no_rule_is_cheaper_than_the_proved_optimum(whole):
    rows = [data.digest(stored) for stored in whole(study.STUDY)]
    found = [game for some in data.games(rows).values() for game in some]
    assert len(found) == len(data.SOCIETIES)
    for game in found:
        assert game.proved
        for rule in data.RULES:
            low, high = game.gaps(rule)
            assert 0 <= low <= high < inf
        assert game.can("pigou")


def test_a_rule_restores_the_optimum_in_both_orders_and_can_in_one():
    game = data.GameUnderRules(
        [
            *(row("selfish", cost, risk) for cost, risk in ((11.0, 0.1), (12.0, 0.3))),
            *(row("partial:0.5", cost) for cost in (10.005, 10.5)),
            *(row("pigou", cost) for cost in (10.0, 10.001)),
            row("right-of-way", 10.0),
            row("right-of-way", 10.0, status="cycle"),
            optimum(10.0),
        ]
    )
    assert [game.restored(rule) for rule in ("selfish", "partial:0.5", "pigou")] == [0, 0, 1]
    assert [game.can(rule) for rule in ("selfish", "partial:0.5", "pigou")] == [0, 1, 1]
    assert game.gaps("selfish") == pytest.approx((0.1, 0.2))
    assert game.gaps("right-of-way") == (0.0, inf)  # one of the orders did not settle
    assert data.worst(game, "selfish").risk == pytest.approx(30)
    said = " ".join(study.words(game.rows))
    assert "2 agents: of 1 games each rule restores the optimum (can restore it) in: " in said
    assert "selfish 0 (0)" in said
    assert "partial:0.5 0 (1)" in said
    assert "pigou 1 (1)" in said
    assert (
        "pigou can restore: 1; the smallest share that can restore it is partial:0.5 in 1" in said
    )


def test_the_cheapest_equilibrium_stands_in_for_an_optimum_that_is_not_known():
    game = data.GameUnderRules([row("selfish", 11.0), row("pigou", 10.0)])
    assert game.best["rule"] == "pigou"
    assert not game.proved
    searched = row(None, 10.4, player="social", status="feasible")
    assert data.GameUnderRules([*game.rows, searched]).best["rule"] == "pigou"
    assert data.GameUnderRules([*game.rows, optimum(10.000001)]).best["player"] == "social"
