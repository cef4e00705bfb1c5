"""Sweeps: cost of the store per cell, and speed-up by a second worker.

The store's cost is measured on one row put repeatedly under new addresses, with the journal and its
checkpoints.  Workers are compared on the same cells, planned and simulated; each figure is the best
of several repeats, since other programs can only slow a machine down.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter

from benchmarks.speed.measurement import Measurement
from benchmarks.sweeps import Cell, Row, Store, sweep
from benchmarks.sweeps.row import make_row
from benchmarks.sweeps.run import play

REPEATS = 3
BLOCKS = 5


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Run every measurement; ``quick`` takes few rows and cells, too few for a speed-up."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        yield from _store(folder, 20 if quick else 500, seed)
        yield _addresses(50 if quick else 500)
        cells = _cells(1, 1000, seed) if quick else _cells(12, 100_000, seed)
        yield from _workers(folder, cells, 1 if quick else REPEATS)


def _store(folder: Path, count: int, seed: int) -> Iterator[Measurement]:
    cell = Cell("head_on", "nash", {"speed": "l1"}, episodes=100, seed=seed)
    report = play((cell, cell.address))
    row = make_row(cell, report)
    with Store(folder / "rows.db") as store:
        blocks = []
        for block in range(BLOCKS):
            rows = [replace(row, address=f"{block:032x}{k:032x}") for k in range(count)]
            blocks.append(_ms(lambda: _put(store, rows), count))  # noqa: B023 - called at once
        yield Measurement("ms to commit a row", min(blocks), 1)
        yield Measurement("ms to read a row", _ms(store.rows, BLOCKS * count), 1)
    making = _ms(lambda: [make_row(cell, report) for _ in range(count)], count)
    yield Measurement("ms to make a row of a report", making, 0, at_least=True)


def _put(store: Store, rows: list[Row]) -> None:
    for row in rows:
        store.put(row)


def _addresses(count: int) -> Measurement:
    cells = [Cell("head_on", "nash", {"lam": k / count}) for k in range(count)]
    spent = _ms(lambda: [cell.address for cell in cells], count)
    return Measurement("ms to make a cell's game and address", spent, 0, at_least=True)


def _workers(folder: Path, cells: list[Cell], repeats: int) -> Iterator[Measurement]:
    """Measure one worker and two, after a first sweep that pays for their start-up."""
    times: dict[int, list[float]] = {1: [], 2: []}
    for repeat in range(repeats + 1):
        for jobs, spent in times.items():
            path = folder / f"{repeat}-{jobs}.db"
            spent.append(_seconds(lambda: sweep(cells, path, jobs=jobs)))  # noqa: B023 - as above
    single, double = (min(spent[1:]) for spent in times.values())
    yield Measurement(f"{len(cells)} cells, one worker: s", single, 0, at_least=True)
    yield Measurement("two workers, times as fast as one", single / double, 1.7, at_least=True)


def _cells(lams: int, episodes: int, seed: int) -> list[Cell]:
    return [
        Cell(
            "intersection3", player, {"lam": k / lams, "speed": "l1"}, episodes=episodes, seed=seed
        )
        for k in range(lams)
        for player in ("nash", "social")
    ]


def _ms(work: Callable[[], object], count: int) -> float:
    return 1e3 * _seconds(work) / count


def _seconds(work: Callable[[], object]) -> float:
    started = perf_counter()
    work()
    return perf_counter() - started
