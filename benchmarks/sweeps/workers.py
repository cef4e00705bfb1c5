"""Apply one function to many items: in this process, on the cores, or on a cluster.

The same code runs on each backend of joblib.  Libraries in the workers use one thread, since the
workers already share the cores: this is set here for loky, and is the default of Dask and Ray.
"""

from __future__ import annotations

import logging
import os
import re
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from benchmarks.sweeps.store import AGAIN
from ppg_env.errors import InputError, require
from ppg_env.support.processes import exit_with_parent

BACKENDS = ("loky", "dask", "ray")
LOKY = BACKENDS[0]

ROUND = 4
"""Items per worker and round on a backend that returns all results of a call at once."""

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Died:
    """The result of an item whose process died."""

    reason: str


def each_done(
    work: Callable[[Item], Result], items: Sequence[Item], jobs: int = 1, backend: str = LOKY
) -> Generator[tuple[Item, Result | Died], None, None]:
    """Yield every item with its result as soon as it is available, in any order.

    If a process dies on this machine, the items that it may have run last are run again one by
    one, each in a process of its own, and the others continue.  Clusters repeat lost work
    themselves.  One job on this machine uses this process.  Exceptions of ``work`` are raised here.

    Raises
    ------
    InputError
        If the backend is unknown or not installed, or a cluster fails.
    """
    check_backend(backend)
    if jobs == 1 and backend == LOKY:
        yield from ((item, work(item)) for item in items)
        return
    left = dict.fromkeys(range(len(items)))  # in order
    with _workers(backend, jobs) as count:
        while left:
            started: list[int] = []
            results = _mapped(work, items, left, count, started)
            try:
                for k, result in results:
                    del left[k]
                    yield items[k], result
            except BrokenProcessPool:
                for k in started:
                    if k in left:
                        del left[k]
                        yield items[k], _run_alone(work, items[k])
            finally:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", UserWarning)  # about abandoned tasks
                    results.close()


def check_backend(name: str) -> None:
    """Refuse an unknown backend."""
    require(name in BACKENDS, "backend", f"is {name!r}", "write " + " or ".join(BACKENDS))


def _mapped(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    which: Iterable[int],
    count: int,
    started: list[int],
) -> Generator[tuple[int, Result], None, None]:
    """Yield results with their indices; ``started`` collects the items handed to a worker."""
    from joblib import Parallel, delayed
    from joblib.parallel import LokyBackend, get_active_backend

    def tasks(some: Iterable[int]) -> Iterator[Any]:
        for k in some:
            started.append(k)
            yield delayed(_indexed)(work, k, items[k], parent)

    local = isinstance(get_active_backend()[0], LokyBackend)
    every, parent = tuple(which), os.getpid() if local else None
    # Batches would hold back results, which a kill then loses.
    if get_active_backend()[0].supports_return_generator:
        yield from Parallel(count, return_as="generator_unordered", batch_size=1)(tasks(every))
        return
    with Parallel(count, batch_size=1) as pool:  # Ray's backend returns all results at once
        size = ROUND * count
        for begin in range(0, len(every), size):
            yield from pool(tasks(every[begin : begin + size]))


def _indexed(
    work: Callable[[Item], Result], k: int, item: Item, parent: int | None
) -> tuple[int, Result]:
    if parent is not None:
        exit_with_parent(parent)  # it would wait for work for minutes
    return k, work(item)


def _run_alone(work: Callable[[Item], Result], item: Item) -> Result | Died:
    try:
        # Two jobs, since joblib runs a single one in this process.
        ((_, result),) = _mapped(work, [item], [0], 2, [])
    except BrokenProcessPool as error:
        codes = re.search(r"\{.*?\}", str(error))
        how = codes[0].strip("{}") if codes else "no exit code"
        return Died(
            f"the process that ran it died ({how}): out of memory, killed, or a faulty back end; "
            "provide more memory, or use fewer jobs, and run failed cells again"
        )
    return result


def _workers(backend: str, jobs: int) -> AbstractContextManager[int]:
    """Select ``backend`` in joblib, and yield the number of jobs to request from it."""
    return {"loky": _loky, "dask": _dask, "ray": _ray}[backend](jobs)


@contextmanager
def _loky(jobs: int) -> Iterator[int]:
    from joblib import parallel_config

    with parallel_config(backend="loky", inner_max_num_threads=1):
        yield jobs


@contextmanager
def _dask(jobs: int) -> Iterator[int]:
    """Use the scheduler named in Dask's configuration, or start a local one."""
    with _readable_errors("dask"):
        import dask
        from distributed import Client
        from joblib import parallel_config

        address = dask.config.get("scheduler-address", None)
        cores = {"n_workers": jobs, "threads_per_worker": 1, "dashboard_address": None}
        client = Client(address) if address else Client(**cores)
        with client, parallel_config(backend="dask"):
            yield -1 if address else jobs


@contextmanager
def _ray(jobs: int) -> Iterator[int]:
    """Use the cluster that RAY_ADDRESS names, or start a local one."""
    with _readable_errors("ray"):
        import ray
        from joblib import parallel_config
        from ray.util.joblib import register_ray

        address = os.environ.get("RAY_ADDRESS")
        ray.init(
            address or "local",  # the default would join any cluster that it finds
            num_cpus=None if address else jobs,
            include_dashboard=False,
            log_to_driver=False,
            logging_level=logging.ERROR,
        )
        register_ray()
        try:
            with parallel_config(backend="ray"):
                yield int(ray.cluster_resources()["CPU"])
        finally:
            ray.shutdown()


@contextmanager
def _readable_errors(backend: str) -> Iterator[None]:
    """Raise a cluster's failures as InputError, with a remedy."""
    try:
        yield
    except InputError:
        raise
    except ImportError as error:
        raise InputError(
            "backend", f"{backend} is not installed ({error})", "install the extra `cluster`"
        ) from None
    except Exception as error:
        raise InputError(
            backend,
            f"the cluster failed ({type(error).__name__}: {error!s:.300})",
            f"see its logs, {AGAIN}",
        ) from None
