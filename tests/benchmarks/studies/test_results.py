"""Digests of a sweep's rows: taken from the file, from the store, or from a run."""

from __future__ import annotations

import json

import pytest

from benchmarks import sweeps
from benchmarks.studies.results import chance, crash_event, digested, grouped, read_rows, write_rows
from benchmarks.sweeps import Cell
from ppg_env import InputError
from tests.benchmarks.studies.conftest import crashing
from tests.benchmarks.sweeps.conftest import quick


def digest(row):
    return {"lam": row.lam, "third": row.lam / 3, "bound": None, "arrival": row.arrival}


def test_rows_come_in_the_order_of_the_cells_and_are_the_same_from_the_file(tmp_path):
    results, cells = tmp_path / "rows.json", quick(3)
    asked = [cells[2], cells[0], cells[2], cells[1]]
    seen = []
    first = digested(results, "test", asked, digest, tmp_path / "a.db", progress=seen.append)
    assert [row["lam"] for row in first] == pytest.approx([c.fields["lam"] for c in asked])
    assert [row["address"] for row in first] == [cell.address for cell in asked]
    assert sum(seen) == len(asked)
    assert "bound" not in first[0]
    assert first[0]["third"] == pytest.approx(2 / 9, rel=1e-7)
    assert len(str(first[0]["third"])) < len(str(2 / 9))
    assert digested(results, "test", asked, digest, tmp_path / "b.db") == first
    assert not (tmp_path / "b.db").exists()


def test_only_what_lacks_is_run_and_other_rows_are_kept(tmp_path, monkeypatch):
    results, cells = tmp_path / "rows.json", quick(4)
    old = digested(results, "test", cells[:2], digest, tmp_path / "rows.db")
    ran, sweep = [], sweeps.sweep

    def watched(some, *words, **options):
        ran.extend(some)
        return sweep(some, *words, **options)

    monkeypatch.setattr(sweeps, "sweep", watched)
    digested(results, "test", cells[1:3], digest, tmp_path / "rows.db")
    assert ran == [cells[2]]
    assert [row["address"] for row in read_rows(results, "test")] == [
        cell.address for cell in cells[:3]
    ]
    assert read_rows(results, "test")[:2] == old


def test_a_cell_without_a_result_has_its_reason_and_is_run_again(tmp_path):
    results = tmp_path / "rows.json"
    hopeless = Cell("head_on", "straight", {"horizon": 2}, episodes=10)
    for _ in range(2):
        (row,) = digested(results, "test", [hopeless], digest, tmp_path / "rows.db")
        assert "horizon" in row["reason"]
        assert row["player"] == "straight"
    fixed = [{"address": hopeless.address, "reason": "the process that ran it died"}]
    write_rows(results, "test", fixed)
    (row,) = digested(results, "test", [hopeless], digest, tmp_path / "rows.db")
    assert "horizon" in row["reason"]


def test_results_of_another_study_are_refused(tmp_path):
    results = tmp_path / "rows.json"
    digested(results, "test", quick(1), digest, tmp_path / "rows.db")
    with pytest.raises(InputError, match="study 'other'"):
        digested(results, "other", quick(1), digest, tmp_path / "rows.db")
    json.loads(results.read_text())


def test_crashes_never_seen_are_reported_by_their_limit():
    assert chance(crashing(0.0, 0.0, 3.7e-5)) == "<4e-5"
    assert chance(crashing(0.0, 0.0213, 0.03)) == "2.1e-2"


def test_groups_are_in_the_order_in_which_they_are_met():
    assert grouped("banana", str) == {"b": ["b"], "a": ["a"] * 3, "n": ["n"] * 2}
    assert list(grouped("banana", str)) == ["b", "a", "n"]


def test_the_rows_say_what_a_crash_is():
    swept = {"collisions": "swept"}
    assert crash_event([]) == crash_event([{}]) == "overlap at the time steps"
    assert crash_event([swept, {"reason": "none"}]) == "overlap during the steps"
    assert crash_event([swept, {}]) == "overlap at the time steps or during the steps"
