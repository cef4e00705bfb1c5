"""Stored results of a study: one JSON file of rows, written whole after every row."""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from ppg_env.errors import InputError
from ppg_env.files import write_atomically
from ppg_env.planfile import to_json

FORMAT = "path-planning-games/results"

Cell = TypeVar("Cell")
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
    rows: list[Row | None] = [
        next((row for row in stored if same(cell, row)), None) for cell in cells
    ]
    missing = [k for k, row in enumerate(rows) if row is None]
    progress(len(cells) - len(missing))
    for k, row in zip(missing, _mapped(run, [cells[k] for k in missing], jobs), strict=True):
        rows[k] = row
        others = [old for old in stored if not any(same(cell, old) for cell in cells)]
        write_rows(path, study, [*others, *(row for row in rows if row is not None)])
        progress(1)
    return [row for row in rows if row is not None]


def _mapped(run: Callable[[Cell], Row], cells: Sequence[Cell], jobs: int) -> Iterator[Row]:
    if jobs == 1 or len(cells) < 2:
        yield from map(run, cells)
        return
    context = multiprocessing.get_context("spawn")
    with _one_thread_each(), ProcessPoolExecutor(jobs, context) as pool:
        yield from pool.map(run, cells)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Keep the workers' linear algebra to one thread: the processes already share the cores."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
