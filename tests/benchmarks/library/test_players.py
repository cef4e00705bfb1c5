"""``ppg library play``: players in the environment, and their entries in records."""

from __future__ import annotations

import json

import pytest

from benchmarks.library.instance import chosen, instances
from benchmarks.library.play import is_current
from benchmarks.library.player_summary import family_rows, player_rows, player_sentences
from benchmarks.library.record import TRACKED, Record

FAST = {"arrival": [5, 5], "controls": [[[1, 0]] * 5 + [[0, 0]] * 3] * 2}
SLOW = {"arrival": [6, 6], "controls": [[[5 / 6, 0]] * 6 + [[0, 0]] * 2] * 2}


def library(ppg, folder, *words, code=0):
    return ppg("library", *words, "--games", folder, code=code)


def submit(ppg, folder, tmp_path, plan):
    path = tmp_path / "plan.json"
    path.write_text(json.dumps(plan))
    return library(ppg, folder, "submit", "lanes", path, "--by", "a test", "--json").json


def play(ppg, folder, *words, code=0):
    run = ("play", "lanes", "--episodes", "400", *words)
    return library(ppg, folder, *run, code=code)


def test_players_of_the_record_are_played_kept_and_shown(ppg, folder, tmp_path):
    submit(ppg, folder, tmp_path, SLOW)
    rows = play(ppg, folder, "--submit", "--json").json["rows"]
    assert [row["player"] for row in rows] == ["social", "straight"]
    for row in rows:
        value, low, high = row["cost"]
        assert low <= value <= high
        assert row["episodes"] == 400
        assert row["arrived"] > 0.9
    assert play(ppg, folder, "--submit", "--json").json["rows"] == []  # nothing to do again
    again = play(ppg, folder, "--json").json["rows"]
    assert [row["cost"] for row in again] == [row["cost"] for row in rows]
    shown = library(ppg, folder, "show", "lanes").out
    assert "straight" in shown
    assert "own state" in shown
    best = min(rows, key=lambda row: row["cost"][0])["player"]
    (listed,) = library(ppg, folder, "list", "lanes", "--json").json["games"]
    assert listed["best_player"] == best
    games = chosen(folder=folder)
    assert {row[0] for row in player_rows(games)} == {"`social`", "`straight`"}
    assert next(player_sentences(games)).startswith("1 games have simulated players")


def test_a_better_plan_removes_the_player_of_the_last_one(ppg, folder, tmp_path):
    submit(ppg, folder, tmp_path, SLOW)
    play(ppg, folder, "--submit")
    submit(ppg, folder, tmp_path, FAST)
    (instance,) = chosen(["lanes"], folder=folder)
    assert set(instance.record.players) == {"straight"}
    play(ppg, folder, "--submit")
    (instance,) = chosen(["lanes"], folder=folder)
    assert set(instance.record.players) == {"social", "straight"}
    assert is_current(instance, "social", 400, 0)
    assert not is_current(instance, "social", 401, 0)
    assert not is_current(instance, "social", 400, 0, ["planned"])


@pytest.mark.slow
def test_regrets_are_bounded_from_both_sides(ppg, folder, tmp_path):
    submit(ppg, folder, tmp_path, FAST)
    words = ("--players", "social", "--deviation", "planned", "--json")
    (row,) = play(ppg, folder, *words).json["rows"]
    assert len(row["regret"]) == 2
    for low, most in row["regret"]:
        assert 0 <= low <= most


def test_every_game_belongs_to_one_family():
    games = instances()
    rows = family_rows(games)
    assert sum(int(row[1]) for row in rows) == len(games)
    assert sum(int(row[2]) for row in rows) == sum(game.record.closed for game in games)
    assert {"head_on", "intersection3", "circle", "maze"} <= {row[0] for row in rows}


def test_a_cheaper_player_is_noted():
    record, origin = Record(), {"by": "a test", "date": "today"}
    assert record.offer_player("a", {"cost": [3.0, 2.9, 3.1], "provenance": origin})
    assert not record.offer_player("b", {"cost": [4.0, 3.9, 4.1], "provenance": origin})
    assert record.best_player == "a"
    assert [entry["what"] for entry in record.history] == ["player a"]


def test_recorded_players_belong_to_recorded_plans():
    games = [game for game in instances() if game.record.players]
    assert len(games) > 200
    for game in games:
        for name, entry in game.record.players.items():
            assert entry["cost"][1] <= entry["cost"][0] <= entry["cost"][2]
            assert 0 <= entry["crash"][1] <= entry["crash"][0] <= entry["crash"][2] <= 1
            if name in TRACKED:
                assert is_current(game, name, entry["episodes"], entry["seed"])


@pytest.mark.parametrize(
    "words",
    [
        ("--players", ""),
        ("--players", "walker"),
        ("--players", "nowhere.npz"),
        ("--players", "receding-nash", "--submit"),
        ("--players", "straight", "--label", "social"),
        ("--players", "straight", "--deviation", "bribed"),
    ],
    ids=" ".join,
)
def test_a_mistake_is_one_sentence(ppg, folder, words):
    done = play(ppg, folder, *words, code=2)
    lines = [line for line in done.err.strip().splitlines() if "players over" not in line]
    assert len(lines) == 1
    assert lines[0].startswith("ppg: ")
