r"""Rows in an SQLite database, one table ``rows``, one row per address.

The journal is a write-ahead log with ``synchronous = NORMAL``: a row is one transaction, which
survives the death of the process at any moment without waiting for the disk.  (A power failure may
lose the last rows, never the file.)  The log needs memory that its users share, so a store is used
by the processes of one machine at a time, preferably on a local disk; machines that share work use
one store each, and merge them.  On file systems without shared memory SQLite keeps its rollback
journal, which is as safe and slower.

Numbers and words have columns of their own; lists and tables are JSON, which SQLite's
``json_each`` and ``json_extract`` read; the game and the plans are JSON compressed by zlib.
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

VERSION = 5
"""Version of the table; raise it when a column is added or removed."""

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
"""When a merged row replaces a stored one."""


class Store:
    """An open store, created if there is none at ``path``; a context manager that closes it.

    Every method raises InputError if the file is no store, cannot be read or written, or is locked
    for longer than ``patience`` seconds (default :data:`PATIENCE`); stored rows are then kept.
    """

    def __init__(self, path: str | Path, *, patience: float | None = None) -> None:
        self.path = Path(path)
        with self._readable_errors():
            wait = PATIENCE if patience is None else patience
            self._base = sqlite3.connect(path, timeout=wait, isolation_level=None)
            try:
                self._open()
            except BaseException:
                self._base.close()
                raise

    def _open(self) -> None:
        # Tables first: a concurrent writer creates them in one transaction with the rest.
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
            # One transaction: other processes see all of it or an empty database.
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
        """Close the file, which takes in its log."""
        self._base.close()

    def get(self, address: str) -> Row | None:
        """Return the row at ``address``, or None."""
        rows = list(self._select(f"SELECT {NAMES} FROM rows WHERE address = ?", address))
        return rows[0] if rows else None

    def put(self, row: Row) -> None:
        """Store ``row``, replacing any with its address; it is committed on return."""
        values = [_packed(kind, getattr(row, name)) for name, kind in COLUMNS.items()]
        marks = ", ".join("?" * len(values))
        with self._readable_errors():
            self._base.execute(INSERT.format(source=f"VALUES ({marks})"), values)

    def addresses(self, *, failed: bool = True) -> set[str]:
        """Return all addresses, or only those of rows with a result."""
        which = "" if failed else " WHERE reason IS NULL"
        with self._readable_errors():
            return {
                address for (address,) in self._base.execute(f"SELECT address FROM rows{which}")
            }

    def rows(self) -> list[Row]:
        """Return all rows, by scenario, player and lam, and then by address."""
        return list(
            self._select(f"SELECT {NAMES} FROM rows ORDER BY scenario, player, lam, address")
        )

    def merge(self, other: str | Path) -> int:
        """Copy rows of the store ``other`` that are missing here, or failed here and not there.

        Returns their number.
        """
        require(Path(other).is_file(), str(other), "does not exist", "check the path")
        with Store(other):  # refuse other files
            pass
        with self._readable_errors():
            before = self._base.total_changes
            self._base.execute("ATTACH ? AS other", (str(other),))
            try:
                # SQLite requires a WHERE between SELECT and ON CONFLICT.
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
        with self._readable_errors():
            for entries in self._base.execute(query, values):
                pairs = zip(COLUMNS.items(), entries, strict=True)
                yield Row(**{name: _unpacked(kind, value) for (name, kind), value in pairs})

    @contextmanager
    def _readable_errors(self) -> Iterator[None]:
        """Raise SQLite's errors as InputError, with a remedy."""
        try:
            yield
        except sqlite3.DatabaseError as error:
            problem, remedy = _problem_and_remedy(error)
            raise InputError(str(self.path), problem, remedy) from None


AGAIN = "and run the same command again: all rows stored so far are kept"


def _problem_and_remedy(error: sqlite3.DatabaseError) -> tuple[str, str]:
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # without the extension
    if code == sqlite3.SQLITE_FULL:
        return "has no room left (the disk is full)", f"free some space, {AGAIN}"
    if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
        return "is locked by another program", f"wait for it or stop it, {AGAIN}"
    if code == sqlite3.SQLITE_CANTOPEN:
        return "cannot be opened", "name a file in an existing, writable folder"
    if code == sqlite3.SQLITE_READONLY:
        return "cannot be written to", f"make it writable, {AGAIN}"
    if code in (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT):
        return f"is not a store of rows ({error})", "name another file"
    return f"cannot be used ({error})", f"fix the cause, {AGAIN}"


def _packed(kind: str, value: Any) -> Any:
    if kind in PLAIN or value is None:
        return value
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return zlib.compress(text.encode()) if kind in PACKED else text


def _unpacked(kind: str, value: Any) -> Any:
    if kind in PLAIN or value is None:
        return value
    return json.loads(zlib.decompress(value) if kind in PACKED else value)
