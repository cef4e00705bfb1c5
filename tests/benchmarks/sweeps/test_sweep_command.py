"""``ppg sweep``: runs, goes on, shares out, merges, exports, and says what failed."""

from __future__ import annotations

import csv
import sqlite3
from pathlib import Path

import pytest

from benchmarks.sweeps import Store

WORDS = ["sweep", "head_on", "--set", "lam=0.1,0.5", "--players", "straight,social"]
WORDS += ["--episodes", "100", "--speed", "l1"]


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_it_runs_once_and_then_reads(ppg):
    assert ppg(*WORDS, "--dry-run").out == "4 cells, 0 stored, 4 to be run\n"
    assert not Path("out/sweep.db").exists()
    first = ppg(*WORDS, "--json").json
    assert {name: first[name] for name in ("cells", "stored", "ran", "failed")} == {
        "cells": 4, "stored": 0, "ran": 4, "failed": 0,
    }  # fmt: skip
    asked = [(row["player"], row["lam"], row["speed"]) for row in first["rows"]]
    assert asked == [(player, lam, "l1") for lam in (0.1, 0.5) for player in ("straight", "social")]
    again = ppg(*WORDS, "--json").json
    assert again["ran"] == 0
    assert again["rows"] == first["rows"]
    assert ppg(*WORDS, "--dry-run", "--json").json == {"cells": 4, "stored": 4, "missing": 0}


def test_the_table_has_a_column_for_what_varies(ppg):
    done = ppg(*WORDS)
    head = next(line for line in done.out.splitlines() if "scenario" in line)
    assert "lam" in head
    assert "horizon" not in head
    assert "overlap" in done.out
    assert "4/4" in done.err


def test_rules_are_columns_of_the_table_and_the_export(ppg):
    rules = ["--set", "collisions=instants,swept", "--set", "on_goal=remove,stay"]
    words = ["sweep", "parallel", *rules, "--players", "straight", "--episodes", "50"]
    head = next(
        line for line in ppg(*words, "--export", "rows.csv").out.splitlines() if "scenario" in line
    )
    assert "collisions" in head
    assert "on goal" in head
    with Path("rows.csv").open(newline="") as file:
        found = [(row["collisions"], row["on_goal"]) for row in csv.DictReader(file)]
    assert sorted(found) == [
        ("instants", "remove"), ("instants", "stay"), ("swept", "remove"), ("swept", "stay"),
    ]  # fmt: skip


def test_a_file_gives_the_same_cells(ppg):
    Path("plan.toml").write_text(
        '[sweep]\ngames = ["head_on"]\nplayers = ["straight", "social"]\nepisodes = 100\n'
        '[set]\nspeed = ["l1"]\nlam = [0.1, 0.5]\n'
    )
    ppg(*WORDS)
    assert ppg("sweep", "plan.toml", "--json").json["ran"] == 0
    assert "whole sweep" in ppg("sweep", "plan.toml", "--lam", "0.5", code=2).err


def test_shards_are_merged_and_exported(ppg):
    ran = [
        ppg(*WORDS, "--shard", f"{k}/2", "--store", f"{k}.db", "--json").json["ran"] for k in (1, 2)
    ]
    assert ran == [2, 2]
    ppg("sweep", "--merge", "1.db", "--merge", "2.db", "--store", "all.db", "--export", "all.csv")
    whole = ppg(*WORDS, "--store", "all.db", "--json").json
    assert whole["ran"] == 0
    with Path("all.csv").open(newline="") as file:
        found = {row["address"]: row for row in csv.DictReader(file)}
    assert set(found) == {row["address"] for row in whole["rows"]}


def test_failing_cells_are_reported_and_end_with_a_code(ppg):
    words = ["sweep", "head_on", "--set", "horizon=3,15", "--players", "straight"]
    done = ppg(*words, "--episodes", "10", code=3)
    assert "1 of 2 cells have no result" in done.err
    assert "set the horizon to 9" in done.err
    assert "unreachable" in done.out
    again = ppg(*words, "--episodes", "10", "--json", code=3).json
    assert (again["ran"], again["failed"]) == (0, 1)
    assert ppg(*words, "--episodes", "10", "--retry", "--json", code=3).json["ran"] == 1


def test_a_locked_store_is_reported(ppg, monkeypatch):
    monkeypatch.setattr("benchmarks.sweeps.store.PATIENCE", 0.05)
    with Store("rows.db"):
        pass
    other = sqlite3.connect("rows.db", isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    message = ppg(*WORDS, "--store", "rows.db", code=2).err
    other.close()
    assert "rows.db: is locked by another program" in message
    assert "all rows stored so far are kept" in message
    assert "Traceback" not in message


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "name games"),
        (["nowhere"], "not a scenario"),
        (["head_on", "--set", "lam"], "FIELD=VALUE"),
        (["head_on", "--set", "lam=1.5"], "0 <= lam < 1"),
        (["head_on", "--set", "lambda=0.5"], "not a field"),
        (["head_on", "--set", "lam=0.5", "--lam", "0.5"], "gives lam again"),
        (["head_on", "--players", "stranger"], "use names of"),
        (["head_on", "--seeds", "x"], "0:5"),
        (["head_on", "--shard", "3/2"], "i/n"),
        (["head_on", "--shard", "3"], "i/n"),
        (["head_on", "--backend", "slurm"], "loky or dask or ray"),
        (["head_on", "--export", "rows.xlsx"], ".csv or .parquet"),
        (["head_on", "--store", "rows.json"], ".db"),
        (["head_on", "--merge", "gone.db"], "does not exist"),
        (["gone.toml"], "does not exist"),
    ],
    ids=" ".join,
)
def test_mistakes_are_reported_in_one_line(ppg, words, message):
    done = ppg("sweep", *words, code=2)
    assert message in done.err
    assert "Traceback" not in done.err
    assert len(done.err.strip().splitlines()) == 1
