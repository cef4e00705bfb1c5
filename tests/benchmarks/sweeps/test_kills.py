"""Killed at random moments, twenty times, a sweep ends with the rows of an undisturbed one."""

from __future__ import annotations

import multiprocessing
import random
import signal
import sqlite3
import time
from multiprocessing.synchronize import Semaphore
from pathlib import Path

import pytest

from benchmarks.sweeps import Cell, Store, sweep
from tests.benchmarks.sweeps.conftest import quick, timeless

KILLS = 20
ROWS = 4  # at most, before each kill
CELLS = 100


def work(cells: list[Cell], store: Path, ran: Semaphore, allowed: Semaphore) -> None:
    """The sweep that is killed.

    It releases ``ran`` when it begins and after every row, and then waits until it is ``allowed``
    to go on: however late the kill comes on a busy machine, there is something left to do.
    """

    def progress(_count: int) -> None:
        ran.release()
        allowed.acquire()

    sweep(cells, store, progress=progress)


@pytest.mark.slow
def test_a_sweep_that_is_killed_again_and_again_ends_as_if_undisturbed(tmp_path: Path):
    cells, store, chance = quick(CELLS), tmp_path / "killed.db", random.Random(0)
    assert len({cell.address for cell in cells}) == CELLS  # known from here on
    context = multiprocessing.get_context("fork")  # at work at once, with everything imported
    counts = []
    for kill in range(KILLS):
        ran, allowed = context.Semaphore(0), context.Semaphore(ROWS)
        victim = context.Process(target=work, args=(cells, store, ran, allowed))
        victim.start()
        if kill % 4:  # else at any moment: it may be opening the file
            assert ran.acquire(timeout=600)
            assert ran.acquire(timeout=600)
        time.sleep(chance.uniform(0, 0.02))
        victim.kill()
        victim.join()
        assert victim.exitcode == -signal.SIGKILL, "it was done before it was killed"
        victim.close()
        if store.exists():
            with sqlite3.connect(store) as base:
                assert base.execute("PRAGMA integrity_check").fetchone() == ("ok",)
            with Store(store) as kept:
                counts.append(len(kept.addresses()))
    assert counts == sorted(counts)  # nothing that was stored is ever lost
    assert 0 < counts[-1] < CELLS
    progress: list[int] = []
    rows = sweep(cells, store, progress=progress.append)
    assert progress == [counts[-1]] + [1] * (CELLS - counts[-1])
    assert timeless(rows) == timeless(sweep(cells, tmp_path / "undisturbed.db"))
