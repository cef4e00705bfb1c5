"""``ppg compare``: rows, intervals, the table, and the picture."""

from __future__ import annotations

import re

import numpy as np
import pytest

from benchmarks.comparison.table import NOTE, STARS, WHERE
from ppg_env import make_game
from tests.benchmarks.judges import picture_size, timeless
from tests.marks import first

PLAYERS = ["nash", "potential", "social", "straight"]
INTERVAL = {"value", "low", "high"}


def compare(ppg, name, *words, players=PLAYERS, code=0):
    options = ["--players", ",".join(players), "--episodes", "20000", "--json", *words]
    return ppg("compare", name, *options, code=code).json


@pytest.mark.parametrize("name", first(2, ["opposing", "head_on", "parallel", "intersection"]))
@pytest.mark.parametrize("objective", ["margin", "risk"])
def test_each_player_has_a_row_with_intervals(ppg, name, objective):
    report = compare(ppg, name, "--objective", objective)
    game = make_game(name, objective=objective)
    assert report["scenario"] == name
    assert report["episodes"] == 20000
    assert [row["player"] for row in report["rows"]] == PLAYERS
    for row in report["rows"]:
        assert {"player", "arrival_mean", "crash_probability", "expected_cost"} <= set(row)
        assert row["arrival_mean"] == pytest.approx(np.mean(row["arrival"]))
        for estimate in (row["crash_probability"], *row["crash_probability_agents"]):
            assert set(estimate) == INTERVAL
            assert 0 <= estimate["low"] <= estimate["value"] <= estimate["high"] <= 1
        cost = row["expected_cost"]
        assert cost["low"] <= cost["value"] <= cost["high"]
        own = [
            agent.lam * arrival + (1 - agent.lam) * game.crash_cost * crash["value"]
            for agent, arrival, crash in zip(
                game.agents, row["arrival"], row["crash_probability_agents"], strict=True
            )
        ]
        assert cost["value"] == pytest.approx(np.mean(own))


def test_crashes_of_feasible_plans_stay_below_their_risk_bound(ppg):
    words = ["--noise", "30", "--speed", "l1"]
    report = compare(ppg, "intersection", *words, players=["social", "straight"])
    for row in report["rows"]:
        if not row["complaints"]:
            assert row["crash_probability"]["low"] <= row["risk_bound_any"]
            for crash, bound in zip(
                row["crash_probability_agents"], row["risk_bound"], strict=True
            ):
                assert crash["low"] <= bound


def test_the_social_optimum_costs_least_and_straight_lines_collide(ppg):
    rows = {row["player"]: row for row in compare(ppg, "head_on", "--speed", "l1")["rows"]}
    for player in ("nash", "potential"):
        assert rows[player]["social_cost"] >= rows["social"]["social_cost"] - 1e-6
        assert max(rows[player]["regret"]) <= 1e-5
    assert "overlap" in rows["straight"]["complaints"][0]
    assert rows["straight"]["crash_probability"]["value"] > 0.99


def test_the_same_seed_gives_the_same_rows_whatever_the_workers(ppg):
    first = timeless(compare(ppg, "head_on", "--seed", "3"))
    assert timeless(compare(ppg, "head_on", "--seed", "3")) == first
    assert timeless(compare(ppg, "head_on", "--seed", "3", "--workers", "2")) == first


def test_players_are_played_once_each_in_the_order_given(ppg):
    report = compare(ppg, "parallel", players=["straight", "social", "straight"])
    assert [row["player"] for row in report["rows"]] == ["straight", "social"]


def test_a_game_without_noise_is_reported_in_strict_json(ppg):
    report = compare(ppg, "head_on", "--noise", "0")
    rows = {row["player"]: row for row in report["rows"]}
    assert rows["social"]["crash_probability"]["value"] == 0
    assert rows["straight"]["crash_probability"]["value"] == 1


def test_people_get_a_table_and_a_picture_and_no_probability_of_zero(ppg, tmp_path):
    picture = tmp_path / "compare.png"
    words = ["--episodes", "2000", "--out", picture]
    done = ppg("compare", "parallel", *words)
    assert all(player in done.out for player in PLAYERS)
    note = done.out.strip().splitlines()[-1].strip()
    assert "* rare-event method; see ppg explain compare" in note
    assert len(note) <= 100
    assert not re.search(r"(?<![\d.])0(\.0+)?(e[+-]00)?(?![\d.])\s+\[", done.out)
    assert "0.00e+00" not in done.out
    width, height = picture_size(picture)
    assert width >= 800
    assert height >= 400
    assert str(picture) in done.err


@pytest.mark.slow
def test_a_picture_is_written_with_json_only_when_asked(ppg, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["compare", "circle(2)", "--players", "straight,social", "--episodes", "100"]
    assert ppg(*words, "--json").json["rows"]
    assert list(tmp_path.iterdir()) == []
    ppg(*words)
    (found,) = tmp_path.rglob("*.png")
    picture_size(found)


def test_a_player_without_a_plan_keeps_its_row_with_the_reason(ppg):
    words = ["--horizon", "9", "--speed", "l1"]
    rows = {row["player"]: row for row in compare(ppg, "head_on", *words)["rows"]}
    assert rows["social"]["status"] == "infeasible"
    assert rows["social"]["advice"]
    assert "crash_probability" not in rows["social"]
    assert rows["straight"]["crash_probability"]["value"] > 0.5


@pytest.mark.parametrize("arena", WHERE)
def test_the_note_fits_into_one_line_with_every_mark(arena):
    marks = "; ".join(STARS.values()) + "; "
    assert len(NOTE.format(episodes=200_000, where=WHERE[arena], stars=marks)) <= 120


def test_a_table_and_a_picture_include_failed_players(ppg, tmp_path):
    words = ["--horizon", "9", "--speed", "l1", "--episodes", "100", "--out", tmp_path / "a.png"]
    done = ppg("compare", "head_on", *words)
    assert all(player in done.out for player in PLAYERS)
    assert "infeasible" in done.out
    picture_size(tmp_path / "a.png")


def test_when_no_player_has_a_plan_the_exit_code_is_3(ppg, tmp_path):
    report = compare(ppg, "head_on", "--horizon", "7", code=3)
    assert {row["status"] for row in report["rows"]} == {"unreachable"}
    picture = tmp_path / "none.png"
    done = ppg("compare", "head_on", "--horizon", "7", "--out", picture, code=3)
    assert "horizon" in done.err
    assert not picture.exists()


def test_a_picture_without_any_plan_is_no_traceback(ppg, tmp_path):
    picture = tmp_path / "none.png"
    compare(ppg, "head_on", "--horizon", "7", "--out", str(picture), code=3)
    assert not picture.exists()


def test_the_tolerance_of_arrivals_is_an_option_in_the_environment_only(ppg):
    words = ["parallel", "--players", "straight", "--episodes", "500"]
    shares = []
    for tolerance in ("0.5", "5", None):
        given = [] if tolerance is None else ["--tolerance", tolerance]
        report = ppg("compare", *words, "--arena", "env", *given, "--json").json
        assert report["tolerance"] == (None if tolerance is None else float(tolerance))
        shares.append(report["rows"][0]["success"])
    assert shares[0][0]["high"] < shares[1][0]["low"]
    assert shares[1] == shares[2]
    done = ppg("compare", *words, "--tolerance", "1", code=2)
    assert "--tolerance: has no effect on schedule; add --arena env" in done.err
