"""Trainings in this process or in several, which report their steps and what they do."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from baselines.policy import Team
from ppg_env.support.processes import exit_with_parent

if TYPE_CHECKING:
    from baselines.training_loop import Activity, Args, Progress

    Train = Callable[[Args, Progress, Activity], Team]
    Run = Callable[[Train, Sequence[Args]], Iterator[Team]]

_to_parent: Any = None


@contextmanager
def reporting_map(jobs: int, progress: Progress, activity: Activity) -> Iterator[Run]:
    """Yield a ``map`` over trainings, in this process or in ``jobs`` of them.

    ``progress`` and ``activity`` are called in this process.
    """
    if jobs == 1:
        yield lambda train, each: map(partial(_train, train, progress, activity), each)
        return
    context = multiprocessing.get_context("spawn")  # torch does not survive a fork
    queue = context.Queue()

    def listen() -> None:
        for report in iter(queue.get, None):
            if isinstance(report, str):
                activity(report)
            else:
                progress(report)

    listener = threading.Thread(target=listen)
    listener.start()
    try:
        with ProcessPoolExecutor(jobs, context, _start_worker, (queue, os.getpid())) as pool:
            yield lambda train, each: pool.map(partial(_train, train, _report, _report), each)
    finally:
        queue.put(None)
        listener.join()


def _train(train: Train, progress: Progress, activity: Activity, args: Args) -> Team:
    return train(args, progress, lambda text: activity(text and f"seed {args.seed}: {text}"))


def _start_worker(queue: Any, parent: int) -> None:
    global _to_parent
    _to_parent = queue
    exit_with_parent(parent)


def _report(report: int | str) -> None:
    _to_parent.put(report)
