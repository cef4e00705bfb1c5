"""``ppg risk`` by simulation: counting, sampling and splitting, and ``compare``'s choice."""

from __future__ import annotations

import pytest

from ppg_env.formats.plan_file import read_plan
from ppg_env.risk.importance_sampling import rare_risk
from ppg_env.risk.monte_carlo import crash_counts
from tests.benchmarks.judges import timeless


@pytest.fixture
def calm_file(ppg, tmp_path):
    """A plan that keeps its distance: crashes are too rare to be counted."""
    plan = tmp_path / "calm.json"
    words = ["--margin-cap", "4", "--solution", "social", "--out", plan]
    ppg("solve", "intersection", *words)
    return plan


def test_counts_have_every_encounter_at_every_time(ppg, plan_file):
    report = ppg("risk", plan_file, "--episodes", "50000", "--json").json
    counts = crash_counts(*read_plan(plan_file)[:2], 50_000)
    (pair,) = report["details"]["encounters"]
    assert pair["times"] == counts.times[0].tolist()
    assert pair["first_times"] == counts.first_times[0].tolist()
    assert pair["hits"] == counts.any == sum(report["details"]["first_any"]) > 0
    assert pair["probability"] == report["any"]["probability"]
    table = ppg("risk", plan_file, "--episodes", "50000").out
    assert f"t = {counts.first_any.argmax()} " in table
    assert "agent_0 and agent_1" in table


def test_watching_steps_says_how_many_crashes_no_instant_shows(ppg, plan_file):
    words = ["--episodes", "500000", "--json"]
    swept = ppg("risk", plan_file, "--swept", *words).json
    instants = ppg("risk", plan_file, *words).json
    assert swept["details"]["instants"]["encounters"] == instants["details"]["encounters"]
    between = swept["details"]["between"][-1]
    more = swept["any"]["probability"] - instants["any"]["probability"]
    assert between["probability"] == pytest.approx(more)
    assert between["hits"] == swept["details"]["hits_any"] - instants["details"]["hits_any"] > 0
    assert "between instants" in ppg("risk", plan_file, "--swept", *words[:2]).out


@pytest.mark.slow
def test_two_plans_are_compared_in_the_same_noise(ppg, plan_file, calm_file):
    words = ["--against", calm_file, "--episodes", "1000000", "--json"]
    report = ppg("risk", plan_file, *words).json
    alone = [ppg("risk", plan, *words[2:]).json for plan in (plan_file, calm_file)]
    assert report["any"] == alone[0]["any"]
    against = report["details"]["against"]
    assert against["any"]["probability"] == alone[1]["any"]["probability"]
    found = report["details"]["difference"]
    assert found["any"]["value"] == pytest.approx(
        against["any"]["probability"] - report["any"]["probability"]
    )
    assert found["any"]["low"] <= found["any"]["value"] <= found["any"]["high"] < 0
    assert len(found["agents"]) == 2
    same = ppg("risk", plan_file, "--against", plan_file, *words[2:]).json["details"]["difference"]
    assert same["only_this"] == same["only_against"] == [0, 0, 0]
    assert "difference" in ppg("risk", plan_file, "--against", calm_file, "--episodes", "1000").out


def test_rare_agrees_with_counting_where_that_is_possible(ppg, plan_file):
    rare = ppg("risk", plan_file, "--method", "rare", "--json").json
    counted = ppg("risk", plan_file, "--episodes", "300000", "--json").json
    assert rare["samples"] == 100_000
    assert counted["any"]["low"] <= rare["any"]["high"]
    assert rare["any"]["low"] <= counted["any"]["high"]
    assert rare["any"]["high"] - rare["any"]["low"] < 0.2 * (
        counted["any"]["high"] - counted["any"]["low"]
    )


def test_rare_finds_what_counting_cannot_and_shows_what_it_is_worth(ppg, calm_file):
    words = ["--method", "rare", "--episodes", "20000"]
    report = ppg("risk", calm_file, *words, "--json").json
    exact = rare_risk(*read_plan(calm_file)[:2], 20_000)
    assert 0 < report["any"]["probability"] == exact.any.value < 1e-6
    details = report["details"]
    assert details["arena"] == "schedule"
    for one in (*details["agents"], details["any"], *details["encounters"]):
        assert one["trusted"] is True
        assert one["standard_error"] < 0.05 * one["value"]
        assert one["effective_samples"] > 100
    table = ppg("risk", calm_file, *words).out
    assert "std. error" in table
    assert "trusted" not in table


def test_an_estimate_that_cannot_be_trusted_says_so(ppg, calm_file):
    words = ["--method", "rare", "--episodes", "30"]
    table = " ".join(ppg("risk", calm_file, *words).out.split())
    assert "Not to be trusted: only" in table
    assert "ask for more episodes" in table
    report = ppg("risk", calm_file, *words, "--json").json
    assert report["details"]["any"]["trusted"] is False
    assert report["any"]["low"] == 0 < report["any"]["high"]


def test_rare_looks_between_instants_too(ppg, tmp_path):
    plan = tmp_path / "plan.json"
    game = ["head_on", "--speed", "l1", "--margin-cap", "4"]
    ppg("solve", *game, "--solution", "social", "--out", plan)
    words = ["--method", "rare", "--episodes", "20000", "--json"]
    swept, instants = ppg("risk", plan, "--swept", *words), ppg("risk", plan, *words)
    between = swept.json["details"]["between"]["any"]
    assert 0 < between["value"] < swept.json["any"]["probability"]
    assert swept.json["any"]["probability"] > instants.json["any"]["probability"]


def test_sampling_depends_on_the_seed_and_not_on_the_workers(ppg, calm_file):
    words = ["risk", calm_file, "--method", "rare", "--episodes", "20000", "--json"]
    one = timeless(ppg(*words, "--seed", "1").json)
    assert timeless(ppg(*words, "--seed", "1", "--workers", "2").json) == one
    assert timeless(ppg(*words, "--seed", "2").json) != one


def test_plans_are_split_in_the_environment(ppg, plan_file):
    words = ["--arena", "env", "--json"]
    split = ppg("risk", plan_file, "--method", "rare", "--episodes", "4000", *words).json
    counted = ppg("risk", plan_file, "--episodes", "20000", *words).json
    assert split["details"]["arena"] == counted["details"]["arena"] == "env"
    error = split["details"]["any"]["standard_error"]
    assert counted["any"]["low"] - 4 * error <= split["any"]["probability"]
    assert split["any"]["probability"] <= counted["any"]["high"] + 4 * error
    assert split["samples"] > 4000


@pytest.mark.slow
def test_learned_players_are_split_and_their_trainings_averaged(ppg):
    game = ["risk", "head_on", "--speed", "l1", "--lam", "0.8", "--player", "ppo-selfish"]
    split = ppg(*game, "--method", "rare", "--episodes", "4000", "--json").json
    counted = ppg(*game, "--episodes", "10000", "--json").json
    error = split["details"]["any"]["standard_error"]
    assert split["player"] == "ppo-selfish"
    assert 0 < error < 0.5 * split["any"]["probability"]
    assert counted["any"]["low"] - 4 * error <= split["any"]["probability"]
    assert split["any"]["probability"] <= counted["any"]["high"] + 4 * error


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (["--method", "bound", "--swept"], "simulation"),
        (["--method", "exact", "--arena", "env"], "simulation"),
        (["--arena", "env", "--swept"], "on schedule"),
        (["--arena", "nowhere"], "schedule or env"),
        (["--method", "rare", "--against", "{plan}"], "--method mc"),
        (["--against", "missing.json"], "missing.json"),
    ],
)
def test_options_that_do_not_go_together_are_exit_code_2(ppg, plan_file, words, advice):
    words = [word.format(plan=plan_file) for word in words]
    done = ppg("risk", plan_file, *words, code=2)
    assert done.out == ""
    assert advice in done.err


def test_replanning_players_are_not_split(ppg):
    done = ppg("risk", "parallel", "--player", "receding-nash", "--method", "rare", code=2)
    assert "--method mc" in done.err


@pytest.mark.slow
def test_compare_samples_what_it_could_not_count_and_says_so(ppg):
    words = ["compare", "intersection", "--margin-cap", "3.5", "--players", "social,straight"]
    rows = ppg(*words, "--episodes", "5000", "--json").json["rows"]
    assert [row["crash_method"] for row in rows] == ["rare", "mc"]
    assert all(row["crash_trusted"] for row in rows)
    rare = rows[0]["crash_probability"]
    assert 0 < rare["low"] < rare["value"] < rare["high"] < 1e-5
    assert rows[0]["expected_cost"]["low"] < rows[0]["expected_cost"]["high"]
    table = " ".join(ppg(*words, "--episodes", "5000").out.split())
    assert "]*" in table
    assert "* rare-event method" in table
    assert "**" not in table


@pytest.mark.slow
def test_compare_splits_in_the_environment(ppg):
    words = ["compare", "parallel", "--noise", "3", "--players", "straight", "--arena", "env"]
    (row,) = ppg(*words, "--episodes", "4000", "--json").json["rows"]
    assert row["crash_method"] == "rare"
    assert 0 < row["crash_probability"]["value"] < 1e-4
