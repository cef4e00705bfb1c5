"""The drill ``kills``: SIGKILL at random moments, and the same command again."""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
import time
from collections.abc import Iterator
from multiprocessing.process import BaseProcess
from pathlib import Path
from random import Random

from tests.drills.figures import Figure, wanted
from tests.drills.resumable import JOBS, Job

KILLS = 50
"""Kills of each command in a night."""

CONTEXT = multiprocessing.get_context("fork")  # with everything imported, but nothing started


def drill(size: float) -> Iterator[Figure]:
    """Kill every command that can be resumed."""
    for name, job in JOBS.items():
        if not wanted(name):
            continue
        job.prepare()
        with tempfile.TemporaryDirectory() as folder:
            yield _killed(name, job, Path(folder), max(round(KILLS * size), 3))


def _killed(name: str, job: Job, root: Path, count: int) -> Figure:
    random, failures, same, kills, last = Random(name), list[str](), 0, 0, 0.0
    expected, seconds = _undisturbed(job, root)
    for k in range(count):
        folder = root / str(k)
        folder.mkdir()
        job.furnish(folder)
        delay = random.uniform(0, 1.1 * seconds)
        victim = _started(job, folder)
        time.sleep(delay)
        victim.kill()
        victim.join()
        kills += victim.exitcode == -signal.SIGKILL
        last = max(last, delay)
        again = _started(job, folder)
        again.join()
        if again.exitcode != 0:
            said = (folder / ".err").read_text("utf-8", "replace").strip().splitlines()[-1:]
            failures.append(f"killed after {delay:.2f} s: exit code {again.exitcode}: {said}")
        elif job.result(folder) != expected:
            failures.append(f"killed after {delay:.2f} s: another result")
        else:
            same += 1
    left = [path.name for path in root.glob("*/.*.*") if path.name not in (".out", ".err")]
    return Figure(
        name,
        f"{count} runs, {kills} of them killed before their end",
        f"{same} of {count} ended with the bytes of an undisturbed run of {seconds:.1f} s"
        + (f"; {len(left)} temporary files stayed behind" if left else ""),
        tuple(failures),
    )


def _undisturbed(job: Job, root: Path) -> tuple[bytes, float]:
    seconds = 0.0
    for k in ("first", "second"):  # the first run compiles and fills caches
        folder = root / k
        folder.mkdir()
        job.furnish(folder)
        started = time.monotonic()
        run = _started(job, folder)
        run.join()
        seconds = time.monotonic() - started
        if run.exitcode != 0:
            raise RuntimeError((folder / ".err").read_text("utf-8", "replace")[-2000:])
    first, second = (job.result(root / k) for k in ("first", "second"))
    if first != second:
        raise RuntimeError("two undisturbed runs differ")
    return second, seconds


def _started(job: Job, folder: Path) -> BaseProcess:
    process = CONTEXT.Process(target=_run, args=(job, folder))
    process.start()
    return process


def _run(job: Job, folder: Path) -> None:
    from benchmarks.cli import main

    os.chdir(folder)
    for name, number in ((".out", 1), (".err", 2)):
        os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), number)
    main([str(word) for word in job.words])
