"""Stored results of a study: one JSON file of rows, written whole after every row."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

from benchmarks.sweeps.pool import Died, each_done
from ppg_env.errors import InputError
from ppg_env.files import write_atomically
from ppg_env.planfile import to_json

FORMAT = "path-planning-games/results"

Cell = TypeVar("Cell", bound=Hashable)
Row = dict[str, Any]


@dataclass(frozen=True)
class Table:
    """What a study tells in a table; ``note`` stands below it."""

    title: str
    columns: tuple[str, ...]
    lines: list[tuple[str, ...]]
    note: str


def probability(value: float, episodes: int) -> str:
    """Two digits; the 97.5 % limit where no crash was seen."""
    shown = f"{value:.1e}" if value else f"<{1 - 0.025 ** (1 / episodes):.0e}"
    return shown.replace("e-0", "e-")


def read_rows(path: Path, study: str) -> list[Row]:
    """The rows in ``path``; none if there is no such file yet."""
    if not path.exists():
        return []
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        known = content["format"] == FORMAT and content["study"] == study
        rows = content["rows"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            str(path), f"cannot be read ({type(error).__name__})", "name another file"
        ) from None
    if not known or not isinstance(rows, list):
        raise InputError(
            str(path), f"does not hold results of the study {study!r}", "name another file"
        )
    return rows


def write_rows(path: Path, study: str, rows: Sequence[Row]) -> None:
    """Store ``rows``, one a line."""
    body = ",\n".join(to_json(row) for row in rows)
    write_atomically(path, f'{{"format": "{FORMAT}", "study": "{study}", "rows": [\n{body}\n]}}\n')


def completed(
    path: Path,
    study: str,
    cells: Sequence[Cell],
    run: Callable[[Cell], Row],
    same: Callable[[Cell, Row], bool],
    *,
    jobs: int = 1,
    progress: Callable[[int], None] = lambda _count: None,
) -> list[Row]:
    """Rows of all ``cells``, in order: stored ones, and those that had to be run."""
    stored = read_rows(path, study)
    rows: dict[Cell, Row] = {}
    for cell, old in product(cells, stored):
        if cell not in rows and same(cell, old):
            rows[cell] = old
    missing = [cell for cell in dict.fromkeys(cells) if cell not in rows]
    progress(len(cells) - len(missing))
    others = [old for old in stored if not any(same(cell, old) for cell in cells)]
    for cell, result in each_done(run, missing, jobs):
        if isinstance(result, Died):
            raise InputError(study, result.reason, "the rows stored so far are kept")
        rows[cell] = result
        write_rows(path, study, [*others, *(rows[one] for one in cells if one in rows)])
        progress(1)
    return [rows[cell] for cell in cells]
