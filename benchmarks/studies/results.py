"""Stored results of a study: a JSON file of rows, small enough for the documentation."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Iterable, Sequence
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

from benchmarks import sweeps
from benchmarks.sweeps.workers import Died, each_done
from ppg_env.errors import InputError
from ppg_env.formats.plan_file import to_json
from ppg_env.game.between_steps import OVERLAP_TIMES
from ppg_env.support.atomic_write import write_atomically
from ppg_env.support.read_file import read_text

FORMAT = "path-planning-games/results"

DIGITS = 8
"""Significant digits that a digest keeps; the store has all of them."""

FREE = 1e-3
"""Costs below this, in steps, count as this in ratios: with lam = 0, time costs nothing."""

NEGLIGIBLE = 1e-4
"""Crash probabilities below this count as this in comparisons.  With the default cost of a crash it
equals a hundredth of a step.  Plans whose margins are all at the paper's cap, between which the
paper's objective is indifferent, have about this crash probability.
"""

Cell = TypeVar("Cell", bound=Hashable)
Item = TypeVar("Item")
Key = TypeVar("Key", bound=Hashable)
StudyRow = dict[str, Any]


def probability(value: float, episodes: int) -> str:
    """Return ``value`` with two digits, or the 97.5 % limit if no crash was counted."""
    shown = f"{value:.1e}" if value else f"<{1 - 0.025 ** (1 / episodes):.0e}"
    return shown.replace("e-0", "e-")


def chance(row: StudyRow) -> str:
    """Return the crash probability of a sweep's row, or its upper limit if it is zero."""
    value, high = row["crash_probability"], row["crash_probability_high"]
    return (f"{value:.1e}" if value else f"<{high:.0e}").replace("e-0", "e-")


def largest_regret(row: sweeps.Row) -> float | None:
    """Return the largest certified regret of an agent in a sweep's row; None without one."""
    return max(bound or 0.0 for bound in row.regret) if row.regret else None


def limits(row: StudyRow) -> tuple[float, float]:
    """Return the 95 % limits of a row's crash probability, at least :data:`NEGLIGIBLE`."""
    low, high = row["crash_probability_low"], row["crash_probability_high"]
    return max(low, NEGLIGIBLE), max(high, NEGLIGIBLE)


def crash_event(rows: Iterable[StudyRow]) -> str:
    """Return what a crash is in the games of ``rows``, in words.

    Rows without a rule of collisions are of the paper's rule.
    """
    rules = {row.get("collisions", "instants") for row in rows if "reason" not in row}
    return f"overlap {' or '.join(OVERLAP_TIMES[rule] for rule in sorted(rules) or ['instants'])}"


def grouped(items: Iterable[Item], key: Callable[[Item], Key]) -> dict[Key, list[Item]]:
    """Return items by key, in the order of the first occurrence of the keys."""
    groups: dict[Key, list[Item]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups


def by_speed(rows: Iterable[StudyRow]) -> dict[str, list[StudyRow]]:
    """Return the rows of each speed set."""
    return grouped(rows, lambda row: str(row["speed"]))


def read_rows(path: Path, study: str) -> list[StudyRow]:
    """Return the rows in ``path``; none if there is no such file."""
    if not path.exists():
        return []
    text = read_text(path)
    try:
        content = json.loads(text)
        valid = content["format"] == FORMAT and content["study"] == study
        rows = content["rows"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(
            str(path), f"cannot be read ({type(error).__name__})", "name another file"
        ) from None
    if not valid or not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError(
            str(path), f"does not hold results of the study {study!r}", "name another file"
        )
    return rows


def write_rows(path: Path, study: str, rows: Sequence[StudyRow]) -> None:
    """Store ``rows``, one per line."""
    body = ",\n".join(to_json(row) for row in rows)
    write_atomically(path, f'{{"format": "{FORMAT}", "study": "{study}", "rows": [\n{body}\n]}}\n')


def completed(
    path: Path,
    study: str,
    cells: Sequence[Cell],
    run: Callable[[Cell], StudyRow],
    same: Callable[[Cell, StudyRow], bool],
    *,
    jobs: int = 1,
    progress: Callable[[int], None] = lambda _count: None,
) -> list[StudyRow]:
    """Return the rows of all ``cells``, in order; cells without a stored row are run.

    The file is rewritten after every row.
    """
    stored = read_rows(path, study)
    rows: dict[Cell, StudyRow] = {}
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
        write_rows(path, study, [*others, *(rows[done] for done in cells if done in rows)])
        progress(1)
    return [rows[cell] for cell in cells]


def digested(
    path: Path,
    study: str,
    cells: Sequence[sweeps.Cell],
    digest: Callable[[sweeps.Row], StudyRow],
    store: Path,
    *,
    jobs: int = 1,
    progress: Callable[[int], None] = lambda _count: None,
) -> list[StudyRow]:
    """Return digests of the rows of all ``cells`` of a sweep, in order.

    Digests are read from ``path``, or computed from rows in ``store`` or from a run.  Cells
    without a result are run again; their digest is their ``reason``.
    """
    stored = {str(row.get("address")): row for row in read_rows(path, study)}
    wanted = {cell.address: cell for cell in cells}
    lacking = [
        cell
        for address, cell in wanted.items()
        if "reason" in stored.get(address, {"reason": "never run"})
    ]
    progress(len(cells) - len(lacking))
    if lacking:
        swept = sweeps.sweep(lacking, store, jobs=jobs, retry=True, progress=progress)
        stored |= {row.address: {"address": row.address, **_kept(row, digest)} for row in swept}
        others = [address for address in stored if address not in wanted]
        write_rows(path, study, [stored[address] for address in (*others, *wanted)])
    return [stored[cell.address] for cell in cells]


def _kept(row: sweeps.Row, digest: Callable[[sweeps.Row], StudyRow]) -> StudyRow:
    """Return the digest and the rule of collisions, without missing values, as after storing it.

    Numbers have :data:`DIGITS` digits.
    """
    if row.failed:
        return {"scenario": row.scenario, "player": row.player, "reason": row.reason}
    kept = {"collisions": row.collisions, **digest(row)}
    values = {name: value for name, value in kept.items() if value is not None}
    return json.loads(json.dumps(values), parse_float=_shortened)


def _shortened(text: str) -> float:
    return float(f"{float(text):.{DIGITS}g}")
