r"""Run the cells that a store lacks, on one core, on several, or on a cluster.

    rows = stored rows + one run of each missing cell;  a row is committed when its run ends

Workers compute; only the calling process writes.  The same code runs on the cores of this machine
(joblib's ``loky``) and on a cluster (joblib's backends for Dask and Ray).  A row depends on its
cell alone, and not on the worker, the order of the runs, or interruptions.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from pathlib import Path
from time import perf_counter
from typing import Any

from benchmarks.comparison.players import Entrant
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
    """Run the cells that ``store`` lacks, and return the rows of all ``cells``, in their order.

    Parameters
    ----------
    jobs
        Number of processes.  One means this process, which a cell that kills its process ends;
        with more, such a cell becomes a failed row.
    shard
        (i, n) selects the i-th of n parts of about equal size, counted from 1.  Only the rows of
        this part are returned.
    backend
        ``loky`` (this machine), ``dask`` or ``ray``.
    retry
        Whether to run failed cells again.
    progress
        Called with the number of stored cells, then with 1 after each run.

    Raises
    ------
    InputError
        If a cell has no valid game or player (then nothing is run), or the store cannot be used
        (then stored rows are kept, and the same call continues from them).
    """
    on_progress = progress or (lambda _count: None)
    check_backend(backend)
    own = part(cells, *shard)
    with Store(store) as base:
        todo = missing(own, base, retry=retry)
        on_progress(len({cell.address for cell in own}) - len(todo))
        # Closed at once if the store fails, so that no worker continues.
        with closing(_run(todo, jobs, backend)) as results:
            for row in results:
                base.put(row)
                on_progress(1)
        stored = {cell.address: base.get(cell.address) for cell in own}
    rows = (stored[cell.address] for cell in own)
    return [row for row in rows if row is not None]


def _run(cells: Sequence[Cell], jobs: int, backend: str) -> Generator[Row, None, None]:
    """Yield the row of each cell when its run ends."""
    tasks = [(cell, cell.address) for cell in cells]
    with closing(each_done(play, tasks, jobs, backend)) as results:
        for (cell, _), report in results:
            yield make_row(cell, _failure(report.reason) if isinstance(report, Died) else report)


def part(cells: Sequence[Cell], index: int, count: int) -> list[Cell]:
    """Return the ``index``-th of ``count`` parts, in the order of ``cells``.

    Cells are dealt out in the order of their addresses, which mixes slow and fast cells.
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
    """Return the cells that ``store`` lacks, each once; with ``retry`` also the failed ones."""
    stored = store.addresses(failed=not retry)
    distinct = {cell.address: cell for cell in cells}
    return [cell for address, cell in distinct.items() if address not in stored]


def play(task: Task) -> Report:
    """Plan or load the player, and simulate; return what ``ppg solve`` and ``ppg compare`` report.

    Errors are part of the report.
    """
    cell, address = task
    started = perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SpectralRadiusWarning)  # shown where the cell was made
            require(
                cell.address == address,
                cell.scenario,
                "is not the same on this worker as in the sweep",
                "do not edit files during a sweep, and install one release everywhere",
            )
            report = _played(cell)
    except Exception as error:  # a failing cell is a row
        text = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        report = _failure(text)
    return report | {"seconds": perf_counter() - started}


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
    if row.played is None:
        return report | {"reason": report["advice"]}
    if cell.deviation is not None and cell.arena == "env":
        report["play_regret"] = _regret(cell, row.entrant)
    return report


def _regret(cell: Cell, ready: Entrant) -> list[dict[str, float]]:
    """Return the gain of each agent by the cell's deviation from run 0 of the player."""
    from baselines.deviations import DeviationOptions
    from baselines.regret import regret_bounds

    bounds = regret_bounds(
        cell.game,
        ready.policies(cell.game, cell)[0],
        deviations=[cell.deviation] if cell.deviation else [],
        episodes=cell.episodes,
        seed=cell.seed,
        options=DeviationOptions(seed=cell.seed, solver=cell.solver, time_limit=cell.time_limit),
    )
    return [vars(bound.regret) for bound in bounds.values()]


def _failure(reason: str) -> Report:
    return {"status": FAILED, "reason": reason}
