"""The store: what is put is what is got; nothing that goes wrong with the file loses a row."""

from __future__ import annotations

import csv
import json
import sqlite3
import warnings
from collections import deque
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.sweeps import Row, Store
from benchmarks.sweeps.row import COLUMNS
from benchmarks.sweeps.store import DamagedRowWarning
from ppg_env import InputError, make_game
from ppg_env.formats.game_file import game_from_tables


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "rows.db"


def some(row: Row, count: int, **changes: object) -> list[Row]:
    return [replace(row, address=f"{k:064}", **changes) for k in range(count)]


def test_a_row_comes_back_as_it_was(row, path):
    with Store(path) as store:
        assert store.get(row.address) is None
        store.put(row)
        assert store.get(row.address) == row
    with Store(path) as store:
        assert store.rows() == [row]
        assert store.addresses() == {row.address}


def test_a_row_carries_its_game_and_plans(row):
    assert game_from_tables(row.game, "row") == make_game("head_on", speed="l1", gain=0.5)
    assert len(row.means) == len(row.controls) == row.agents == 2
    assert len(row.means[0]) == row.horizon + 1 == len(row.controls[0]) + 1


@given(
    st.floats(allow_nan=False, allow_infinity=False), st.text(), st.integers(-(2**63), 2**63 - 1)
)
def test_numbers_and_words_are_exact(tmp_path_factory, number, words, whole):
    row = make(number, words, whole)
    with Store(tmp_path_factory.mktemp("exact") / "rows.db") as store:
        store.put(row)
        assert store.get("a") == row


def make(number: float, words: str, whole: int) -> Row:
    values = {
        "str": words, "int": whole, "float": number, "Numbers": [number, None], "Counts": [whole],
        "Words": [words], "Estimates": [{"value": number}], "Table": {words: number},
        "GameTables": {words: [number]}, "Paths": [[[number]]],
    }  # fmt: skip
    return Row(**{name: values[kind] for name, kind in COLUMNS.items()} | {"address": "a"})


def test_every_field_is_a_column(row, path):
    with Store(path) as store:
        store.put(row)
    with sqlite3.connect(path) as base:
        found = [name for _, name, *_ in base.execute("PRAGMA table_info(rows)")]
        assert found == [*(one.name for one in fields(Row)), "digest"]
        (cost,) = base.execute("SELECT json_extract(shifted_cost, '$[1]') FROM rows").fetchone()
    assert cost == row.shifted_cost[1]


def test_a_store_can_be_asked_in_sql_while_it_is_written(row, path):
    with Store(path) as store:
        store.put(row)
        with sqlite3.connect(path) as base:
            query = 'SELECT player, crash_probability_high, "order" FROM rows WHERE lam < 0.6'
            assert base.execute(query).fetchall() == [
                ("nash", row.crash_probability_high, "cyclic")
            ]
        store.put(replace(row, address="another"))


def test_the_last_put_counts(row, path):
    with Store(path) as store:
        store.put(row)
        store.put(replace(row, social_cost=1.0))
        assert [one.social_cost for one in store.rows()] == [1.0]


def test_merging_takes_what_is_missing_or_failed(row, path, tmp_path):
    one, two, three = some(row, 3)
    with Store(path) as store, Store(tmp_path / "other.db") as other:
        store.put(one)
        store.put(replace(two, reason="died"))
        other.put(replace(one, social_cost=-1.0))
        other.put(two)
        other.put(replace(three, reason="died"))
    with Store(path) as store:
        assert store.merge(tmp_path / "other.db") == 2
        assert store.rows() == [one, two, replace(three, reason="died")]
        assert store.merge(tmp_path / "other.db") == 0
        assert store.addresses(failed=False) == {one.address, two.address}


def test_a_full_disk_is_reported_and_loses_nothing(row, path):
    first, *others = some(row, 200)
    with Store(path) as store:
        store.put(first)
        store._base.execute("PRAGMA max_page_count = 12")
        with pytest.raises(InputError, match=r"disk is full.*free some space.*are kept"):
            deque(map(store.put, others))
        kept = store.rows()
        assert first in kept
    with Store(path) as store:  # there is room again
        assert store.rows() == kept
        store.put(others[-1])
        assert others[-1] in store.rows()


def test_a_locked_store_is_reported_and_loses_nothing(row, path):
    one, two = some(row, 2)
    with Store(path, patience=0.05) as store:
        store.put(one)
        other = sqlite3.connect(path, isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(InputError, match=r"locked by another program.*are kept"):
            store.put(two)
        other.execute("ROLLBACK")
        store.put(two)
        assert store.rows() == [one, two]
        other.close()


def test_two_stores_may_write_to_one_file(row, path):
    one, two = some(row, 2)
    with Store(path) as first, Store(path) as second:
        first.put(one)
        second.put(two)
        assert first.rows() == second.rows() == [one, two]


@pytest.mark.parametrize("kind", ["text", "database", "newer", "folder", "nowhere", "read-only"])
def test_what_is_no_store_is_refused(row, path, kind):
    if kind == "text":
        path.write_text("These are no rows. " * 100)
    elif kind == "database":
        with sqlite3.connect(path) as base:
            base.execute("CREATE TABLE birds (name TEXT)")
    elif kind == "newer":
        with Store(path) as store:
            store._base.execute("PRAGMA user_version = 99")
    elif kind == "folder":
        path.mkdir()
    elif kind == "nowhere":
        path = path / "in" / "no" / "folder.db"
    else:
        with Store(path) as store:
            store._base.execute("PRAGMA query_only = 1")
            with pytest.raises(InputError, match="cannot be written"):
                store.put(row)
        return
    before = path.read_bytes() if path.is_file() else None
    with pytest.raises(InputError, match=str(path)):
        Store(path)
    assert before is None or path.read_bytes() == before


def test_a_store_to_merge_must_exist(path):
    with Store(path) as store, pytest.raises(InputError, match="does not exist"):
        store.merge(path.with_name("gone.db"))


def test_csv_has_all_but_the_plans(row, path, tmp_path):
    with Store(path) as store:
        for one in some(row, 3):
            store.put(one)
        store.export(tmp_path / "rows.csv")
    with (tmp_path / "rows.csv").open(newline="") as file:
        found = list(csv.DictReader(file))
    assert len(found) == 3
    for one in found:
        assert float(one["social_cost"]) == row.social_cost
        assert json.loads(one["shifted_cost"]) == row.shifted_cost
        assert one["reason"] == ""
        assert not set(one) & {"game", "means", "controls"}


def test_parquet_has_everything_with_its_type(row, path, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    with Store(path) as store:
        for one in some(row, 2, reason=None, time_limit=None):
            store.put(one)
        store.export(tmp_path / "rows.parquet")
    table = parquet.read_table(tmp_path / "rows.parquet")
    assert table.column_names == list(COLUMNS)
    (first, _) = table.to_pylist()
    for name, kind in COLUMNS.items():
        value = getattr(row, name)
        if name == "address":
            continue
        if kind in ("Table", "GameTables") and value is not None:
            assert json.loads(first[name]) == value
        else:
            assert first[name] == value, name
    assert str(table.schema.field("time_limit").type) == "double"


def test_other_tables_are_refused(path):
    with Store(path) as store, pytest.raises(InputError, match=r"\.csv or \.parquet"):
        store.export("rows.xlsx")


def test_no_flipped_bit_changes_a_row(row, path):
    rows = some(row, 5)
    with Store(path) as store:
        for one in rows:
            store.put(one)
    whole = path.read_bytes()
    draws = np.random.default_rng(0)
    read, refused = 0, 0
    for _ in range(150):
        damaged = bytearray(whole)
        damaged[draws.integers(len(whole))] ^= 1 << draws.integers(8)
        path.write_bytes(damaged)
        try:
            with warnings.catch_warnings(), Store(path) as store:
                warnings.simplefilter("ignore", DamagedRowWarning)
                found = store.rows()
                assert store.addresses() <= {one.address for one in found}
                assert all(one in rows for one in found)
                read += len(found) == len(rows) - 1
                assert store.merge(path) == 0
        except InputError:
            refused += 1
    assert read > 20  # only the damaged row is missing
    assert refused < 100


def test_a_damaged_row_is_missing_and_can_be_stored_again(row, path, tmp_path):
    one, two = some(row, 2)
    with Store(path) as store:
        store.put(one)
        store.put(two)
    with sqlite3.connect(path) as base:
        base.execute("UPDATE rows SET social_cost = 1.0 WHERE address = ?", (one.address,))
    with Store(path) as store:
        with pytest.warns(DamagedRowWarning, match="1 damaged rows count as missing"):
            assert store.rows() == [two]
        with pytest.warns(DamagedRowWarning):
            assert store.get(one.address) is None
        with Store(tmp_path / "whole.db") as other:
            other.put(one)
        with pytest.warns(DamagedRowWarning):
            assert store.merge(tmp_path / "whole.db") == 1
        assert store.rows() == [one, two]


def test_a_store_removed_while_it_is_used_is_reported(row, path):
    with Store(path) as store:
        path.unlink()
        with pytest.raises(InputError, match="was removed or replaced while it was in use"):
            store.put(row)


def test_a_store_without_a_column_is_refused(row, path):
    with Store(path) as store:
        store.put(row)
    with sqlite3.connect(path) as base:
        base.execute("ALTER TABLE rows DROP COLUMN bound")
    with pytest.raises(InputError, match="has no plain table of rows with all columns"):
        Store(path)


def test_text_of_a_formula_is_text_in_csv(row, path, tmp_path):
    with Store(path) as store:
        store.put(replace(row, scenario="=cmd()"))
        store.export(tmp_path / "rows.csv")
    with (tmp_path / "rows.csv").open(newline="") as stream:
        assert next(csv.DictReader(stream))["scenario"] == "'=cmd()"
