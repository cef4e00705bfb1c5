"""``ppg equilibria``, and the limits and families of ``ppg solve`` that came with many agents."""

from __future__ import annotations

import pytest

from ppg_env import evaluate
from ppg_env.formats.plan_file import read_plan


def test_both_sides_are_named_and_certified(ppg):
    report = ppg("equilibria", "head_on", "--speed", "l1", "--runs", "4", "--json").json
    kinds = report["equilibria"]
    assert {kind["name"] for kind in kinds} == {"0<1 left", "0<1 right"}
    assert sum(kind["found"] for kind in kinds) == report["runs"] == 4
    assert all(max(kind["regret"]) <= 1e-4 for kind in kinds)
    assert kinds[report["cheapest"]]["social_cost"] <= kinds[report["dearest"]]["social_cost"]
    risks = [kind["risk_bound_any"] for kind in kinds]
    assert risks[report["safest"]] == min(risks)
    assert risks[report["riskiest"]] == max(risks)


def test_the_table_names_the_best_and_the_worst(ppg):
    done = ppg("equilibria", "circle(4)", "--speed", "l1", "--runs", "4")
    for word in ("cheapest", "costliest", "safest", "riskiest", "left", "right"):
        assert word in done.out


def test_no_equilibrium_within_the_limits_is_said(ppg):
    done = ppg("equilibria", "opposing", "--runs", "1", "--horizon", "3", code=3)
    assert "none of 1 runs" in done.err


@pytest.mark.slow
def test_many_agents_are_certified(ppg):
    report = ppg("solve", "circle(8)", "--solution", "nash", "--json").json
    assert report["status"] == "equilibrium"
    assert max(report["regret"]) <= 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("solution", ["social", "potential"])
def test_a_limit_on_nodes_leaves_a_plan_a_bound_and_a_gap(ppg, solution):
    words = ["--solution", solution, "--node-limit", "2000", "--json"]
    first, again = (ppg("solve", "circle(6)", *words).json for _ in range(2))
    assert first["status"] == "feasible"
    assert 0 < first["gap"] < 1
    assert first["bound"] <= first["value"]
    assert [first["value"], first["bound"]] == [again["value"], again["bound"]]
    assert "gap is proved" in first["advice"]


@pytest.mark.slow
def test_prices_plans_and_other_rules_of_liability(ppg, tmp_path):
    words = ("head_on", "--speed", "l1", "--objective", "risk", "--gain", "0", "--lam", "0.8")
    words += ("--runs", "2")
    stem = tmp_path / "found"
    done = ppg("equilibria", *words, "--price", "--out", stem)
    assert "price of stability 1.0" in done.out
    assert "keep each other on their left" in done.out
    report = ppg("equilibria", *words, "--price", "--json").json
    low, high = report["optimum"]
    assert low <= high
    for name, row in (("price_of_stability", 0), ("price_of_anarchy", -1)):
        cost = report["equilibria"][row]["social_cost"]
        assert report[name] == pytest.approx([cost / high, cost / low])
        assert report[name][0] >= 1
    for k, row in enumerate(report["equilibria"]):
        game, profile, stored = read_plan(f"{stem}-{k + 1}.json")
        assert evaluate(game, profile).social_cost == pytest.approx(row["social_cost"])
        assert stored["solution"] == "nash"
    shared = ppg("equilibria", *words, "--charge", "pigou", "--json").json
    assert shared["equilibria"][0]["social_cost"] < 0.99 * report["equilibria"][0]["social_cost"]
    assert "--charge" in ppg("equilibria", *words, "--charge", "pigou", "--price", code=2).err
    assert "equal to 10000" in ppg("equilibria", "head_on", "--runs", "100000", code=2).err
