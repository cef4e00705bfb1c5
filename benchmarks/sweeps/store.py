r"""Rows in an SQLite database, one table ``rows``, one row per address.

The journal is a write-ahead log with ``synchronous = NORMAL``: a row is one transaction, which
survives the death of the process at any moment without waiting for the disk.  (A power cut may
take the last rows, never the file.)  The log needs memory that its users share, so a store belongs
to the processes of one machine at a time, on a disk of its own if it can be; machines that share
work have a store each, to be merged.  On file systems without shared memory SQLite keeps to its
rollback journal, as safe and slower.

Numbers and words are columns of their own; lists and tables are JSON, which SQLite's ``json_each``
and ``json_extract`` read; the game and the plans are JSON compressed by zlib.
"""

from __future__ import annotations

import json
import sqlite3
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

from benchmarks.sweeps.row import COLUMNS, PACKED, Row
from ppg_env.errors import InputError, require

APPLICATION = 0x50504753
"""Marks the file as a store ("PPGS")."""

VERSION = 3
"""Of the table; to be raised when a column comes or goes."""

PATIENCE = 30.0
"""Seconds to wait for a database that another program has locked."""

PLAIN = {"str": "TEXT", "int": "INTEGER", "float": "REAL"}
TYPES = {
    name: PLAIN.get(kind, "BLOB" if kind in PACKED else "TEXT") for name, kind in COLUMNS.items()
}
TABLE = ", ".join(f'"{name}" {kind}' for name, kind in TYPES.items())
NAMES = ", ".join(f'"{name}"' for name in COLUMNS)

INSERT = f"""
INSERT INTO rows ({NAMES}) {{source}}
ON CONFLICT (address) DO UPDATE SET {", ".join(f'"{name}" = excluded."{name}"' for name in COLUMNS)}
"""
BETTER = "WHERE rows.reason IS NOT NULL AND excluded.reason IS NULL"
"""When a row that is merged takes the place of one that is there."""


class Store:
    """An open store; made if there is none at ``path``.  A context manager that closes it.

    Every method raises InputError if the file is no store, cannot be read or written, or is locked
    for longer than ``patience`` seconds (:data:`PATIENCE` unless given); the rows stored before
    are then still there.
    """

    def __init__(self, path: str | Path, *, patience: float | None = None) -> None:
        self.path = Path(path)
        with self._plain_words():
            wait = PATIENCE if patience is None else patience
            self._base = sqlite3.connect(path, timeout=wait, isolation_level=None)
            try:
                self._open()
            except BaseException:
                self._base.close()
                raise

    def _open(self) -> None:
        # Tables first: whoever made them since has set the rest in the same transaction.
        (tables,) = self._base.execute("SELECT count(*) FROM sqlite_master").fetchone()
        (mark,) = self._base.execute("PRAGMA application_id").fetchone()
        (version,) = self._base.execute("PRAGMA user_version").fetchone()
        ours = mark == APPLICATION or not tables
        require(ours, str(self.path), "is not a store of rows", "name another file")
        require(
            version == VERSION or not tables,
            str(self.path),
            f"has version {version}, and this release reads version {VERSION}",
            "name a new file, and export the old one with the release that wrote it",
        )
        self._base.execute("PRAGMA journal_mode = WAL")
        self._base.execute("PRAGMA synchronous = NORMAL")
        if not tables:
            # One transaction: whoever opens the file sees all of it or an empty database.
            self._base.executescript(
                f"BEGIN IMMEDIATE;"
                f"CREATE TABLE IF NOT EXISTS rows ({TABLE}, PRIMARY KEY (address)) WITHOUT ROWID;"
                f"PRAGMA application_id = {APPLICATION}; PRAGMA user_version = {VERSION}; COMMIT;"
            )

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; its log is then part of it."""
        self._base.close()

    def get(self, address: str) -> Row | None:
        """The row at ``address``, if there is one."""
        found = list(self._select(f"SELECT {NAMES} FROM rows WHERE address = ?", address))
        return found[0] if found else None

    def put(self, row: Row) -> None:
        """Store ``row`` in the place of any with its address; done when this returns."""
        values = [_packed(kind, getattr(row, name)) for name, kind in COLUMNS.items()]
        holes = ", ".join("?" * len(values))
        with self._plain_words():
            self._base.execute(INSERT.format(source=f"VALUES ({holes})"), values)

    def addresses(self, *, failed: bool = True) -> set[str]:
        """All addresses, or those of rows with a result."""
        which = "" if failed else " WHERE reason IS NULL"
        with self._plain_words():
            return {found for (found,) in self._base.execute(f"SELECT address FROM rows{which}")}

    def rows(self) -> list[Row]:
        """All rows, by scenario, player and lam, and then by address."""
        return list(
            self._select(f"SELECT {NAMES} FROM rows ORDER BY scenario, player, lam, address")
        )

    def merge(self, other: str | Path) -> int:
        """Take over the rows of the store ``other`` that are not here, or failed here and not
        there; returns how many.
        """
        require(Path(other).is_file(), str(other), "does not exist", "check the path")
        with Store(other):  # is it one?
            pass
        with self._plain_words():
            before = self._base.total_changes
            self._base.execute("ATTACH ? AS other", (str(other),))
            try:
                # SQLite wants a WHERE between SELECT and ON CONFLICT.
                source = f"SELECT {NAMES} FROM other.rows WHERE true"
                self._base.execute(INSERT.format(source=source) + BETTER)
            finally:
                self._base.execute("DETACH other")
            return self._base.total_changes - before

    def export(self, path: str | Path) -> Path:
        """Write all rows to a .csv or .parquet file."""
        from benchmarks.sweeps.export import export_rows

        return export_rows(self.rows(), path)

    def _select(self, query: str, *values: Any) -> Iterator[Row]:
        with self._plain_words():
            for found in self._base.execute(query, values):
                pairs = zip(COLUMNS.items(), found, strict=True)
                yield Row(**{name: _unpacked(kind, value) for (name, kind), value in pairs})

    @contextmanager
    def _plain_words(self) -> Iterator[None]:
        """Tell in a sentence what SQLite finds wrong with the file."""
        try:
            yield
        except sqlite3.DatabaseError as error:
            problem, remedy = _told(error)
            raise InputError(str(self.path), problem, remedy) from None


AGAIN = "and run the same command again: all rows stored so far are kept"


def _told(error: sqlite3.DatabaseError) -> tuple[str, str]:
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # without the extension
    if code == sqlite3.SQLITE_FULL:
        return "has no room left (the disk is full)", f"free some space, {AGAIN}"
    if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
        return "is locked by another program", f"wait for it or stop it, {AGAIN}"
    if code == sqlite3.SQLITE_CANTOPEN:
        return "cannot be opened", "name a file in a folder that exists and is yours"
    if code == sqlite3.SQLITE_READONLY:
        return "cannot be written to", f"make it yours, {AGAIN}"
    if code in (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT):
        return f"is not a store of rows ({error})", "name another file"
    return f"cannot be used ({error})", f"mend that, {AGAIN}"


def _packed(kind: str, value: Any) -> Any:
    if kind in PLAIN or value is None:
        return value
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return zlib.compress(text.encode()) if kind in PACKED else text


def _unpacked(kind: str, value: Any) -> Any:
    if kind in PLAIN or value is None:
        return value
    return json.loads(zlib.decompress(value) if kind in PACKED else value)
