"""Export of rows to a file: CSV, or Parquet with types.

Lists are JSON in CSV and lists in Parquet; tables, such as the game, are JSON in both.  CSV omits
the large columns: the game, means and controls.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.sweeps.row import COLUMNS, PACKED, Row
from ppg_env.errors import InputError, require
from ppg_env.formats.csv_text import csv_text
from ppg_env.support.atomic_write import write_atomically

SUFFIXES = (".csv", ".parquet")


def check_export(path: str | Path) -> None:
    """Refuse a file of another kind; called before any work is done."""
    supported = Path(path).suffix.lower() in SUFFIXES
    require(
        supported, str(path), "is not a table", "name a file ending in " + " or ".join(SUFFIXES)
    )


def export_rows(rows: Sequence[Row], path: str | Path) -> Path:
    """Write ``rows`` to a .csv or .parquet file, atomically."""
    check_export(path)
    as_bytes = _csv if Path(path).suffix.lower() == ".csv" else _parquet
    return write_atomically(path, as_bytes(rows))


def _csv(rows: Sequence[Row]) -> bytes:
    columns = [name for name, kind in COLUMNS.items() if kind not in PACKED]
    cells = ([_text(getattr(row, name)) for name in columns] for row in rows)
    return csv_text(columns, cells).encode()


def _text(value: Any) -> Any:
    return json.dumps(value) if isinstance(value, (list, dict)) else value


def _parquet(rows: Sequence[Row]) -> bytes:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise InputError(
            ".parquet", "needs pyarrow", "install the extra `parquet`, or name a .csv file"
        ) from None
    number, estimate = pa.float64(), [(name, pa.float64()) for name in ("value", "low", "high")]
    types = {
        "str": pa.string(),
        "int": pa.int64(),
        "float": number,
        "Numbers": pa.list_(number),
        "Counts": pa.list_(pa.int64()),
        "Words": pa.list_(pa.string()),
        "Estimates": pa.list_(pa.struct(estimate)),
        "Table": pa.string(),
        "GameTables": pa.string(),
        "Paths": pa.list_(pa.list_(pa.list_(number))),
    }
    arrays = {
        name: pa.array([_cell(kind, getattr(row, name)) for row in rows], types[kind])
        for name, kind in COLUMNS.items()
    }
    buffer = io.BytesIO()
    parquet.write_table(pa.table(arrays), buffer)
    return buffer.getvalue()


def _cell(kind: str, value: Any) -> Any:
    table = kind in ("Table", "GameTables") and value is not None
    return json.dumps(value) if table else value
