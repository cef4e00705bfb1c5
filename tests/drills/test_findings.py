"""What the drills have found, each as a test."""

from __future__ import annotations

import io
import json
import sqlite3
import zipfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from baselines import read_learned
from benchmarks.library.judge import verdict
from benchmarks.library.record import read_record
from benchmarks.library.runs import REQUIRED, _append, read_lines
from benchmarks.sweeps import Store
from benchmarks.sweeps.grid import whole_numbers
from ppg_env import InputError
from ppg_env.formats.game_file import game_from_tables
from tests.drills.hostile_files import _endless_view, _trigger

AGENT = {"goal": [0, 50], "shape": {"box": [1, 1]}, "control": {"l1": 9}}


def test_a_header_that_is_no_python_is_refused(tmp_path: Path) -> None:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("about.npy", b"\x93NUMPY\x01\x00\x10\x00{'descr': (((((\n\n\n")
    (tmp_path / "players.npz").write_bytes(stream.getvalue())
    with pytest.raises(InputError, match="cannot be read"):
        read_learned(tmp_path / "players.npz")


@pytest.mark.parametrize("make", [_endless_view, _trigger])
def test_a_store_with_a_view_or_a_trigger_is_refused(tmp_path: Path, make) -> None:
    make(tmp_path)
    with pytest.raises(InputError, match="no plain table of rows"):
        Store(tmp_path / "rows.db")


def test_a_store_with_a_damaged_schema_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rows.db"
    Store(path).close()
    with sqlite3.connect(path) as base:
        base.execute("PRAGMA writable_schema = ON")
        base.execute("UPDATE sqlite_master SET sql = CAST(x'99' AS TEXT)")
    with pytest.raises(InputError, match=r"is not a store of rows|cannot be used"):
        Store(path)


@pytest.mark.parametrize("text", ["0:1000000000000", "-5:1000000000000", f"{10**30}:{10**30 + 2}"])
def test_seeds_without_end_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"at most 100,000 numbers|smaller numbers"):
        whole_numbers("seeds", text)
    assert whole_numbers("seeds", "2:5") == (2, 3, 4)


def test_numbers_beyond_floats_make_no_plan() -> None:
    lanes = SimpleNamespace(tables={"game": {}, "agent": [AGENT | {"start": [0, 0]}]})
    plan = {"arrival": [5], "controls": [[[10**400, 0]] * 15]}
    assert not verdict(lanes, plan)["accepted"]


def test_a_line_that_was_cut_off_is_written_again(tmp_path: Path) -> None:
    path, line = tmp_path / "runs.jsonl", dict.fromkeys(REQUIRED, "one")
    _append(path, line)
    with path.open("a", encoding="utf-8") as file:
        file.write('{"game": "tw')
    assert [entry["game"] for entry in read_lines(path)] == ["one"]
    _append(path, line | {"game": "two"})
    assert [json.loads(text)["game"] for text in path.read_text().splitlines()] == ["one", "two"]


@pytest.mark.parametrize(
    "change",
    [{"social": {"social_cost": "x", "provenance": {}}}, {"bound": {"value": 1}}, {"risk": []},
     {"equilibria": [{"social_cost": 1, "provenance": 3}]}, {"history": {}}],
)  # fmt: skip
def test_a_record_of_wrong_types_is_refused(tmp_path: Path, change) -> None:
    (tmp_path / "1.json").write_text(json.dumps(change))
    with pytest.raises(InputError, match="is not a record"):
        read_record(tmp_path / "1.json")


def test_games_too_large_to_play_are_refused_at_once() -> None:
    many = [AGENT | {"start": [3 * k, 0]} for k in range(1001)]
    with pytest.raises(InputError, match="has 1001 tables; write at most 1000"):
        game_from_tables({"agent": many}, "file")
    body = {"vertices": [[k, k * k] for k in range(1001)]}
    with pytest.raises(InputError, match="has 1001 rows; write at most 1000"):
        game_from_tables({"agent": [AGENT | {"start": [0, 0], "shape": body}]}, "file")
    obstacle = {"polygon": body["vertices"]}
    with pytest.raises(InputError, match="has 1001 points; write at most 1000"):
        game_from_tables({"agent": [AGENT | {"start": [0, 0]}], "obstacle": [obstacle]}, "file")
