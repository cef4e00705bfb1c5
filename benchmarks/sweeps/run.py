r"""Running the cells that a store lacks, on one core, many, or a cluster.

    rows = stored rows + one run of each missing cell;  every run's row is committed when it ends

Workers compute; only the process that called writes.  The same code runs on the cores of this
machine (joblib's ``loky``) and on a cluster (joblib's backends for Dask and Ray).  A row depends on
its cell alone, so rows do not depend on who runs what, in which order, or after how many kills.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from time import perf_counter
from typing import Any

from benchmarks.sweeps.cell import Cell
from benchmarks.sweeps.row import FAILED, Row, make_row
from benchmarks.sweeps.store import Store
from benchmarks.sweeps.workers import LOKY, Died, check_backend, each_done
from ppg_env.errors import InputError, require
from ppg_env.game.agent import SpectralRadiusWarning

Task = tuple[Cell, str]
"""A cell and its address."""

Report = dict[str, Any]


def sweep(
    cells: Sequence[Cell],
    store: str | Path,
    *,
    jobs: int = 1,
    shard: tuple[int, int] = (1, 1),
    backend: str = LOKY,
    retry: bool = False,
    progress: Callable[[int], None] | None = None,
) -> list[Row]:
    """Rows of ``cells``, in their order; those that ``store`` lacks are run and stored.

    Parameters
    ----------
    jobs
        Processes.  One is this process itself, which a cell that kills its process then ends;
        with more, such a cell becomes a row that says so.
    shard
        (i, n) takes the i-th of n parts of about equal size, counted from 1; the parts together
        are all cells.  Only rows of this part are returned.
    backend
        ``loky`` (this machine), ``dask`` or ``ray``.
    retry
        Whether to run cells again that have failed before.
    progress
        Called with the number of cells that were found stored, then with 1 after each run.

    Raises
    ------
    InputError
        If a cell describes no game or player (nothing is run then), or the store cannot be used;
        rows stored before are kept, and the same call goes on from there.
    """
    tell = progress or (lambda _count: None)
    check_backend(backend)
    mine = part(cells, *shard)
    with Store(store) as base:
        todo = missing(mine, base, retry=retry)
        tell(len({cell.address for cell in mine}) - len(todo))
        tasks = [(cell, cell.address) for cell in todo]
        # Closed at once if the store fails, so that no worker goes on in vain.
        with closing(each_done(play, tasks, jobs, backend)) as results:
            for (cell, _), report in results:
                found = _failure(report.reason) if isinstance(report, Died) else report
                base.put(make_row(cell, found))
                tell(1)
        rows = {cell.address: base.get(cell.address) for cell in mine}
    return [row for cell in mine if (row := rows[cell.address]) is not None]


def part(cells: Sequence[Cell], index: int, count: int) -> list[Cell]:
    """The ``index``-th of ``count`` parts, in the order of ``cells``.

    Cells are dealt out in the order of their addresses, in which dear and cheap ones are mixed.
    """
    require(
        1 <= index <= count,
        "shard",
        f"is {index}/{count}",
        "write i/n with 1 <= i <= n, such as 1/4",
    )
    dealt = set(sorted({cell.address for cell in cells})[index - 1 :: count])
    return [cell for cell in cells if cell.address in dealt]


def missing(cells: Sequence[Cell], store: Store, *, retry: bool = False) -> list[Cell]:
    """Those of ``cells`` that ``store`` lacks, each once; with ``retry`` also those that failed."""
    stored = store.addresses(failed=not retry)
    distinct = {cell.address: cell for cell in cells}
    return [cell for address, cell in distinct.items() if address not in stored]


def play(task: Task) -> Report:
    """Plan or load, and simulate, as ``ppg solve`` and ``ppg compare`` report it.

    Any error is part of the report.
    """
    cell, address = task
    begun = perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SpectralRadiusWarning)  # said where the cell was made
            require(
                cell.address == address,
                cell.scenario,
                "is not the same to this worker as to the sweep",
                "leave files alone while it runs, and install one release everywhere",
            )
            report = _played(cell)
    except Exception as error:  # a failing cell is a row
        said = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        report = _failure(said)
    return report | {"seconds": perf_counter() - begun}


def _played(cell: Cell) -> Report:
    from benchmarks.comparison.compare import compare
    from benchmarks.comparison.report import solution_report
    from benchmarks.comparison.results import row_report

    (row,) = compare(
        cell.game, [cell.player], cell.episodes, cell, arena=cell.arena, groups=cell.groups
    )
    report = row_report(row)
    if row.solution is not None:
        report = solution_report(row.solution) | report
    return report if row.played else report | {"reason": report["advice"]}


def _failure(reason: str) -> Report:
    return {"status": FAILED, "reason": reason}
