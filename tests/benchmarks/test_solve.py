"""``ppg solve``: the keys and sizes of design.md, section 4, and its exit codes."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ppg_env import evaluate, make_game, make_profile
from tests.benchmarks.judges import timeless
from tests.marks import first

KEYS = {
    *("scenario", "solution", "objective", "status", "arrival", "cost", "shifted_cost"),
    *("social_cost", "safety_cost", "deficit", "risk_bound", "bound", "gap", "regret"),
    *("means", "controls", "seconds"),
}
SOLUTIONS = ("nash", "potential", "social", "best-response")


def shown(value):
    """Nested lists back to arrays."""
    return np.array(value, dtype=float)


@pytest.mark.parametrize("solution", SOLUTIONS)
@pytest.mark.parametrize("name", first(1, ["opposing", "intersection3"]))
@pytest.mark.parametrize("objective", ["margin", "risk"])
def test_the_report_has_every_key_in_its_size(ppg, solution, name, objective):
    words = ["--solution", solution, "--objective", objective, "--json"]
    done = ppg("solve", name, *words)
    report, game = done.json, make_game(name, objective=objective)
    count, steps = len(game.agents), game.horizon
    assert set(report) >= KEYS
    assert report["scenario"] == name
    assert report["solution"] == solution
    assert report["objective"] == objective
    for key in ("arrival", "cost", "shifted_cost", "safety_cost", "deficit", "risk_bound"):
        assert shown(report[key]).shape == (count,), key
    assert shown(report["means"]).shape == (count, steps + 1, 2)
    assert shown(report["controls"]).shape == (count, steps, 2)
    assert report["seconds"] >= 0
    assert done.out.count("\n") == 1


@pytest.mark.parametrize("solution", SOLUTIONS)
@pytest.mark.parametrize("objective", ["margin", "risk"])
def test_the_numbers_are_the_evaluators(ppg, solution, objective):
    words = ["--solution", solution, "--objective", objective, "--lam", "0.3,0.6", "--json"]
    report = ppg("solve", "parallel", *words).json
    game = make_game("parallel", objective=objective, lam=[0.3, 0.6])
    judged = evaluate(game, make_profile(game, report["controls"]))
    assert report["arrival"] == list(judged.arrival)
    for key in ("cost", "shifted_cost", "safety_cost", "deficit", "risk_bound"):
        np.testing.assert_allclose(report[key], getattr(judged, key), atol=1e-9, err_msg=key)
    assert report["social_cost"] == pytest.approx(sum(report["shifted_cost"]))
    assert report["complaints"] == []


@pytest.mark.parametrize("solution", ["potential", "social", "best-response"])
def test_what_was_minimised_has_a_bound_and_a_gap(ppg, solution):
    report = ppg("solve", "intersection", "--solution", solution, "--json").json
    assert report["status"] == "optimal"
    assert report["bound"] <= report["value"] + 1e-6
    assert 0 <= report["gap"] <= 1e-6
    value = {
        "potential": report["potential"],
        "social": report["social_cost"],
        "best-response": report["shifted_cost"][0],
    }[solution]
    assert report["value"] == pytest.approx(value)


@pytest.mark.parametrize("solution", ["nash", "potential"])
def test_equilibria_carry_a_regret_per_agent(ppg, solution):
    report = ppg("solve", "intersection3", "--solution", solution, "--json").json
    assert len(report["regret"]) == 3
    assert all(0 <= regret <= 1e-5 for regret in report["regret"])


@pytest.mark.parametrize("solution", SOLUTIONS)
def test_the_same_seed_gives_the_same_report(ppg, solution):
    words = ["solve", "head_on", "--solution", solution, "--seed", "5"]
    words += ["--order", "random"] * (solution == "nash")
    first, again = (timeless(ppg(*words, "--json").json) for _ in range(2))
    assert first == again


@pytest.mark.parametrize("agent", [0, 1])
def test_a_best_response_is_of_the_agent_that_was_asked(ppg, tmp_path, agent):
    plan = tmp_path / "plan.json"
    ppg("solve", "head_on", "--solution", "social", "--out", plan)
    words = ["--solution", "best-response", "--agent", agent, "--against", plan]
    report = ppg("solve", "head_on", *words, "--json").json
    social = json.loads(plan.read_text())
    assert report["controls"][1 - agent] == social["controls"][1 - agent]
    assert report["shifted_cost"][agent] <= social["shifted_cost"][agent] + 1e-6


@pytest.mark.parametrize("solution", SOLUTIONS)
def test_a_table_is_for_people_and_says_how_it_ended(ppg, solution):
    done = ppg("solve", "opposing", "--solution", solution)
    assert "agent_0" in done.out
    assert "agent_1" in done.out
    assert ("equilibrium" if solution == "nash" else "optimal") in done.out


@pytest.mark.parametrize("solution", SOLUTIONS)
def test_a_goal_out_of_reach_is_exit_code_3_with_advice(ppg, solution):
    words = ["solve", "head_on", "--horizon", "7", "--solution", solution]
    report = ppg(*words, "--json", code=3).json
    assert report["status"] == "unreachable"
    assert "horizon" in report["advice"]
    assert "controls" not in report
    people = ppg(*words, code=3)
    assert people.out == ""
    assert "no solution" in people.err
    assert "horizon" in people.err


@pytest.mark.parametrize("solution", ["potential", "social"])
def test_an_infeasible_program_is_exit_code_3_with_advice(ppg, solution):
    words = ["solve", "head_on", "--horizon", "9", "--speed", "l1", "--solution", solution]
    report = ppg(*words, "--json", code=3).json
    assert report["status"] == "infeasible"
    assert "overlap" in report["advice"]


@pytest.mark.parametrize("solution", SOLUTIONS)
def test_no_time_is_exit_code_3_and_leaves_no_file(ppg, tmp_path, solution):
    plan = tmp_path / "plan.json"
    words = ["solve", "intersection3", "--speed", "l1", "--solution", solution, "--out", plan]
    report = ppg(*words, "--time-limit", "0", "--json", code=3).json
    assert report["status"] == "time_limit"
    assert not plan.exists()
    assert list(tmp_path.iterdir()) == []
