"""``ppg certify`` and ``ppg risk`` on a plan file that ``ppg solve`` wrote."""

from __future__ import annotations

import json
from importlib import import_module

import pytest

from benchmarks.commands.risk import METHODS
from benchmarks.crash_risk.query import Chance, at_most
from ppg_env import evaluate
from ppg_env.formats.plan_file import read_plan
from solvers import certify
from tests.benchmarks.judges import timeless


def test_a_plan_file_is_strict_json_that_carries_its_game(plan_file):
    def refuse(word):
        raise AssertionError(word)

    content = json.loads(plan_file.read_text(), parse_constant=refuse)
    game, profile, report = read_plan(plan_file)
    assert content["scenario"] == "intersection"
    assert game.agents[0].noise.tolist() == [[40.0, 0.0], [0.0, 40.0]]
    assert len(profile) == 2
    assert report["status"] == "optimal"


def test_certify_gives_a_regret_per_agent_and_their_maximum(ppg, plan_file):
    proof = ppg("certify", plan_file, "--json").json
    game, profile, _ = read_plan(plan_file)
    expected = certify(game, profile)
    assert proof["regret"] == pytest.approx(expected.regret.tolist(), abs=1e-6)
    assert proof["epsilon"] == max(proof["regret"])
    assert all(regret >= 0 for regret in proof["regret"])


def test_a_social_optimum_is_certified_when_agents_pay_for_harm(ppg, plan_file):
    assert ppg("certify", plan_file, "--charge", "pigou", "--json").json["epsilon"] <= 1e-4


def test_an_equilibrium_is_certified_as_one(ppg, tmp_path):
    plan = tmp_path / "nash.json"
    regret = ppg("solve", "head_on", "--speed", "l1", "--out", plan, "--json").json["regret"]
    proof = ppg("certify", plan, "--json").json
    assert proof["epsilon"] <= 1e-5
    assert len(regret) == len(proof["regret"])
    assert "agent_0" in ppg("certify", plan).out


def test_a_plan_whose_means_overlap_is_refused(ppg, plan_file, tmp_path):
    content = json.loads(plan_file.read_text())
    straight = [[[10.0, 0.0]] * 8 + [[0.0, 0.0]] * 7, [[0.0, 10.0]] * 8 + [[0.0, 0.0]] * 7]
    bad = tmp_path / "bad.json"
    bad.write_text(json.dumps(content | {"controls": straight}))
    done = ppg("certify", bad, "--json", code=2)
    assert done.out == ""
    assert "overlap" in done.err


@pytest.mark.parametrize("method", METHODS)
def test_risk_has_an_interval_for_each_agent_and_for_any(ppg, plan_file, method):
    words = ["--method", method, "--episodes", "20000", "--json"]
    report = ppg("risk", plan_file, *words).json
    assert report["method"] == method
    assert report["samples"] == (20000 if method in ("mc", "rare") else 0)
    assert report["seconds"] >= 0
    assert len(report["agents"]) == 2
    for entry in (*report["agents"], report["any"]):
        assert set(entry) == {"probability", "low", "high"}
        assert 0 <= entry["low"] <= entry["probability"] <= entry["high"] <= 1


def test_the_bound_is_the_plans_risk_bound_and_simulation_stays_below(ppg, plan_file):
    bound = ppg("risk", plan_file, "--method", "bound", "--json").json
    counted = ppg("risk", plan_file, "--method", "mc", "--episodes", "50000", "--json").json
    written = json.loads(plan_file.read_text())["risk_bound"]
    for i in (0, 1):
        assert bound["agents"][i]["high"] == pytest.approx(min(written[i], 1.0))
        assert counted["agents"][i]["low"] <= bound["agents"][i]["high"]
    assert counted["any"]["probability"] > 0
    assert counted["any"]["low"] <= bound["any"]["high"]


def test_simulation_depends_on_the_seed_and_not_on_the_workers(ppg, plan_file):
    words = ["risk", plan_file, "--episodes", "300000", "--json"]
    one = timeless(ppg(*words, "--seed", "1").json)
    assert timeless(ppg(*words, "--seed", "1").json) == one
    assert timeless(ppg(*words, "--seed", "1", "--workers", "2").json) == one
    assert timeless(ppg(*words, "--seed", "2").json) != one


def test_a_crash_that_was_never_seen_is_not_called_impossible(ppg, tmp_path):
    plan = tmp_path / "calm.json"
    ppg("solve", "parallel", "--noise", "0.01", "--out", plan)
    table = ppg("risk", plan, "--episodes", "1000").out
    assert "< 3.7e-03" in table  # Clopper-Pearson: 1 - 0.025^(1/1000)
    assert ppg("risk", plan, "--episodes", "1000", "--json").json["any"]["high"] > 0


def test_the_command_knows_all_methods():
    assert all(callable(getattr(import_module(home), name)) for name, home in METHODS.items())


def test_exact_lies_between_the_likeliest_instant_and_the_bound(ppg, plan_file):
    exact = ppg("risk", plan_file, "--method", "exact", "--json").json
    bound = ppg("risk", plan_file, "--method", "bound", "--json").json
    counted = ppg("risk", plan_file, "--method", "mc", "--episodes", "100000", "--json").json
    for one, two, three in zip(
        (*exact["agents"], exact["any"]),
        (*bound["agents"], bound["any"]),
        (*counted["agents"], counted["any"]),
        strict=True,
    ):
        assert one["probability"] == one["high"] <= two["high"]
        assert one["low"] <= three["high"]
        assert three["low"] <= one["high"]


def test_details_have_every_bound_with_its_ratio_and_every_instant(ppg, plan_file):
    details = ppg("risk", plan_file, "--method", "bound", "--json").json["details"]
    game, profile, _ = read_plan(plan_file)
    bounds = details["bounds"]
    assert len(bounds["agents"]) == 2
    for one in (*bounds["agents"], bounds["any"]):
        values = [one[name] for name in ("union", "faces", "instants", "tree", "least")]
        assert values == sorted(values, reverse=True)
        assert one["ratios"] == pytest.approx(
            {name: one[name] / one["tree"] for name in ("union", "faces", "instants", "tree")}
        )
    (pair,) = details["encounters"]
    assert (pair["agents"], pair["obstacle"]) == ([0, 1], None)
    assert len(pair["instants"]) == len(pair["log10_instants"]) == game.horizon + 1
    traffic = evaluate(game, profile).traffic[0]
    assert [log is not None for log in pair["log10_instants"]][1:] == traffic.tolist()[1:]
    assert sum(pair["instants"]) == pytest.approx(bounds["any"]["instants"])


def test_a_games_players_plan_first(ppg, plan_file):
    words = ["--method", "exact", "--json"]
    by_plan = ppg("risk", plan_file, *words).json
    game = ["intersection", "--noise", "40", "--player", "social"]
    by_player = ppg("risk", *game, *words).json
    assert by_player["player"] == "social"
    assert by_player["any"] == pytest.approx(by_plan["any"])
    assert "agent_0 and agent_1, t = " in ppg("risk", *game, "--method", "exact").out


def test_players_without_plans_are_counted_in_the_environment(ppg, learned_file):
    game = ["risk", "intersection", "--speed", "l1", "--player", learned_file]
    report = ppg(*game, "--episodes", "500", "--json").json
    assert report["details"]["arena"] == "env"
    assert len(report["agents"]) == 2
    assert "has no plan" in ppg(*game, "--method", "exact", code=2).err


def test_replanning_players_play_in_the_environment(ppg):
    game = ["risk", "intersection", "--speed", "l1", "--player", "receding-social"]
    assert ppg(*game, "--episodes", "20", "--json").json["details"]["arena"] == "env"
    assert "receding-social, which has no plan" in ppg(*game, "--method", "bound", code=2).err


def test_players_that_find_no_plan_are_exit_code_3(ppg):
    words = ["--horizon", "3", "--method", "exact", "--json"]
    assert ppg("risk", "head_on", *words, code=3).out == ""


@pytest.mark.parametrize(
    "words", [["--player", "social"], ["--lam", "0.3"], ["--margin-cap", "2"]], ids=" ".join
)
def test_a_plan_has_its_game_and_players_already(ppg, plan_file, words):
    done = ppg("risk", plan_file, *words, code=2)
    assert words[0] in done.err
    assert "leave it out" in done.err


def test_bounds_are_rounded_up_and_nothing_seen_shows_the_limit():
    assert at_most(0.031201) == "3.13e-02"
    assert at_most(0.0312) == "3.12e-02"
    assert str(Chance(0.1, 0.0, 0.1)).startswith("<= ")
    assert float(str(Chance(0.1, 0.0, 0.1))[3:]) >= 0.1
    assert str(Chance(0.0, 0.0, 0.0036)) == "< 3.6e-03"
    assert str(Chance(0.020001, 0.010099, 0.020001)) == "<= 2.01e-02, >= 1.00e-02"
    assert str(Chance(0.02, 0.01, 0.03)) == "2.00e-02 [1.0e-02, 3.0e-02]"


def test_a_plan_that_cannot_crash_within_a_float_still_shows_a_limit(ppg, tmp_path):
    plan = tmp_path / "calm.json"
    ppg("solve", "parallel", "--noise", "0.0001", "--out", plan)
    report = ppg("risk", plan, "--method", "exact", "--json").json
    assert report["any"]["high"] > 0
    assert max(x for x in report["details"]["encounters"][0]["log10_instants"] if x) < -300
    assert "1e-" in ppg("risk", plan, "--method", "exact").out


@pytest.mark.parametrize("words", [["--method", "guess"], ["--episodes", "0"]])
def test_a_bad_option_is_exit_code_2(ppg, plan_file, words):
    assert ppg("risk", plan_file, *words, code=2).out == ""


def test_a_file_that_is_no_plan_is_exit_code_2(ppg, tmp_path):
    for text in ("", "[]", '{"format": "something else"}', "not json"):
        file = tmp_path / "plan.json"
        file.write_text(text)
        for verb in ("certify", "risk", "render"):
            done = ppg(verb, file, code=2)
            assert str(file) in done.err
