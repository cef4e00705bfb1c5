r"""Rows in an SQLite database, one table ``rows``, one row per address.

The journal is a write-ahead log with ``synchronous = NORMAL``: a row is one transaction, which
survives the death of the process at any moment without waiting for the disk.  (A power failure may
lose the last rows, never the file.)  The log needs memory that its users share, so a store is used
by the processes of one machine at a time, preferably on a local disk; machines that share work use
one store each, and merge them.  On file systems without shared memory SQLite keeps its rollback
journal, which is as safe and slower.

Numbers and words have columns of their own; lists and tables are JSON, which SQLite's
``json_each`` and ``json_extract`` read; the game and the plans are JSON compressed by zlib.  Each
row has a digest of its entries: a row that a disk or a program has damaged counts as missing.
"""

from __future__ import annotations

import json
import shutil
import sqlite3
import warnings
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

from benchmarks.sweeps.row import COLUMNS, PACKED, Row
from benchmarks.sweeps.row_digest import row_digest
from ppg_env.errors import InputError, require
from ppg_env.support.processes import size_limited

APPLICATION = 0x50504753
"""Marks the file as a store ("PPGS")."""

VERSION = 6
"""Version of the table; raise it when a column is added or removed."""

PATIENCE = 30.0
"""Seconds to wait for a database that another program has locked."""

PLAIN = {"str": "TEXT", "int": "INTEGER", "float": "REAL"}
TYPES = {
    name: PLAIN.get(kind, "BLOB" if kind in PACKED else "TEXT") for name, kind in COLUMNS.items()
}
TABLE = ", ".join(f'"{name}" {kind}' for name, kind in (TYPES | {"digest": "BLOB"}).items())
NAMES = ", ".join(f'"{name}"' for name in (*COLUMNS, "digest"))
MARKS = ", ".join("?" * (len(COLUMNS) + 1))

REASON = list(COLUMNS).index("reason")


class DamagedRowWarning(UserWarning):
    """Rows of a store that are not as they were written."""


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
            # Damaged text must not end the reading of the rows after it.
            self._base.text_factory = lambda text: text.decode("utf-8", "surrogateescape")
            try:
                self._open()
                self._file = self._identity()
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
        require(
            not tables or self._complete(),
            str(self.path),
            "has no plain table of rows with all columns",
            "name another file",
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

    def _complete(self) -> bool:
        columns = {name for _, name, *_ in self._base.execute("PRAGMA table_info(rows)")}
        # A view could be endless, and a trigger changes rows that are written.
        objects = "SELECT type FROM sqlite_master WHERE name = 'rows' OR type = 'trigger'"
        kinds = [kind for (kind,) in self._base.execute(objects)]
        return columns == {*COLUMNS, "digest"} and kinds == ["table"]

    def _identity(self) -> tuple[int, int] | None:
        try:
            state = self.path.stat()
        except OSError:
            return None
        return state.st_dev, state.st_ino

    def get(self, address: str) -> Row | None:
        """Return the row at ``address``; None if there is none, or a damaged one."""
        rows = list(self._select("WHERE address = ?", address))
        return _row(rows[0]) if rows else None

    def put(self, row: Row) -> None:
        """Store ``row``, replacing any with its address; it is committed on return."""
        require(
            self._identity() == self._file,
            str(self.path),
            "was removed or replaced while it was in use",
            "run the same command again, and leave the file where it is",
        )
        entries = [_packed(kind, getattr(row, name)) for name, kind in COLUMNS.items()]
        self._insert(entries)

    def _insert(self, entries: Sequence[Any]) -> None:
        with self._readable_errors():
            self._base.execute(
                f"INSERT OR REPLACE INTO rows ({NAMES}) VALUES ({MARKS})",
                [*entries, row_digest(entries)],
            )

    def addresses(self, *, failed: bool = True) -> set[str]:
        """Return all addresses, or only those of rows with a result; damaged rows have none."""
        return {entries[0] for entries in self._select("") if failed or entries[REASON] is None}

    def rows(self) -> list[Row]:
        """Return all rows, by scenario, player and lam, and then by address."""
        return [
            _row(entries) for entries in self._select("ORDER BY scenario, player, lam, address")
        ]

    def merge(self, other: str | Path) -> int:
        """Copy rows of the store ``other`` that are missing here, or failed here and not there.

        Returns their number.
        """
        require(Path(other).is_file(), str(other), "does not exist", "check the path")
        reasons = {entries[0]: entries[REASON] for entries in self._select("")}
        copied = 0
        with Store(other) as source, self._transaction():
            for entries in source._select(""):
                failed_here = reasons.get(entries[0]) is not None
                better = failed_here and entries[REASON] is None
                if better or entries[0] not in reasons:
                    self._insert(entries)
                    copied += 1
        return copied

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._readable_errors():
            self._base.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            self._base.execute("ROLLBACK")
            raise
        with self._readable_errors():
            self._base.execute("COMMIT")

    def export(self, path: str | Path) -> Path:
        """Write all rows to a .csv or .parquet file."""
        from benchmarks.sweeps.export import export_rows

        return export_rows(self.rows(), path)

    def _select(self, clause: str, *values: Any) -> Iterator[tuple[Any, ...]]:
        """Yield the entries of each row, without its digest; damaged rows are left out."""
        damaged = 0
        with self._readable_errors():
            for *entries, digest in self._base.execute(
                f"SELECT {NAMES} FROM rows {clause}", values
            ):
                if digest == row_digest(entries):
                    yield tuple(entries)
                else:
                    damaged += 1
        if damaged:
            warnings.warn(
                f"{self.path}: {damaged} damaged rows count as missing; the same sweep runs them "
                "again.",
                DamagedRowWarning,
                stacklevel=3,
            )

    @contextmanager
    def _readable_errors(self) -> Iterator[None]:
        """Raise SQLite's errors as InputError, with a remedy."""
        try:
            yield
        except sqlite3.DatabaseError as error:
            problem, remedy = _problem_and_remedy(error, self.path.parent)
            raise InputError(str(self.path), problem, remedy) from None
        except UnicodeDecodeError:  # SQLite quotes a damaged schema
            raise InputError(
                str(self.path), "is not a store of rows (damaged text)", "name another file"
            ) from None


AGAIN = "and run the same command again: all rows stored so far are kept"


ROOM = 64 << 10
"""Bytes that SQLite needs to open its log; with fewer it reports an error of the disk."""


def _problem_and_remedy(error: sqlite3.DatabaseError, folder: Path) -> tuple[str, str]:
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # without the extension
    full = code == sqlite3.SQLITE_IOERR and shutil.disk_usage(folder).free < ROOM
    if full or code == sqlite3.SQLITE_FULL:
        return "has no room left (the disk is full)", f"free some space, {AGAIN}"
    if code == sqlite3.SQLITE_IOERR and size_limited():
        return "would exceed the limit on file sizes", f"raise it (ulimit -f), {AGAIN}"
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
    if kind == "float" and value is not None:
        return float(value) + 0.0  # as SQLite returns it, without -0.0
    if kind in PLAIN or value is None:
        return value
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return zlib.compress(text.encode()) if kind in PACKED else text


def _row(entries: Sequence[Any]) -> Row:
    pairs = zip(COLUMNS.items(), entries, strict=True)
    return Row(**{name: _unpacked(kind, value) for (name, kind), value in pairs})


def _unpacked(kind: str, value: Any) -> Any:
    if kind in PLAIN or value is None:
        return value
    return json.loads(zlib.decompress(value) if kind in PACKED else value)
