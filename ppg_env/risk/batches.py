"""Blocks of episodes, each with its own noise, made from the seed and the block's number.

Results therefore do not depend on the order of the blocks or the number of workers, and a longer
run contains the episodes of a shorter one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from threading import local
from typing import TypeVar

import numpy as np

from ppg_env.errors import require

BLOCK = 1024
"""Episodes per block: small enough for the cache, large enough to hide Python's overhead."""

MOST_SAMPLES = 10**10
"""Largest number of episodes, about an hour of plain ones; counts stay far below 2^63."""

AHEAD = 4
"""Largest number of pending blocks per worker; bounds the memory for any number of episodes."""

Result = TypeVar("Result")


class Scratch:
    """An array of one shape for each thread, reused by the thread's next block.

    Allocating memory costs more than drawing the normals that fill it.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._shape, self._local = shape, local()

    def __call__(self) -> np.ndarray:
        """Return the array of the calling thread, with arbitrary content."""
        if not hasattr(self._local, "array"):
            self._local.array = np.empty(self._shape)
        array: np.ndarray = self._local.array
        return array


def check_request(samples: int, seed: int, start: int = 0) -> None:
    """Raise :class:`~ppg_env.errors.InputError` for a request out of range."""
    require(
        1 <= samples <= MOST_SAMPLES,
        "samples",
        f"is {samples}",
        f"ask for 1 to {MOST_SAMPLES:,} episodes",
    )
    require(seed >= 0, "seed", f"is {seed}", "give a number that is not negative")
    whole = start >= 0 and start % BLOCK == 0
    require(whole, "start", f"is {start}", f"give a multiple of {BLOCK:,} that is not negative")


def generator(seed: int, *key: int) -> np.random.Generator:
    """Return the generator of one block's noise."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=key)))


def over_blocks(
    function: Callable[[int, int], Result], samples: int, workers: int = 1, start: int = 0
) -> Iterator[tuple[int, Result]]:
    """Yield, in order, each block's number of episodes and ``function(block, episodes)``.

    There are ``workers`` threads; NumPy and compiled code run in parallel.  The first ``start``
    episodes, whole blocks, are left out.
    """
    blocks, end = range(start // BLOCK, -(-(start + samples) // BLOCK)), start + samples
    jobs = ((b, min(BLOCK, end - b * BLOCK)) for b in blocks)
    if workers == 1:
        for number, episodes in jobs:
            yield episodes, function(number, episodes)
        return
    with ThreadPoolExecutor(workers) as pool:
        pending: deque[tuple[int, Future[Result]]] = deque()
        for number, episodes in jobs:
            pending.append((episodes, pool.submit(function, number, episodes)))
            if len(pending) >= AHEAD * workers:
                oldest, future = pending.popleft()
                yield oldest, future.result()
        for episodes, future in pending:
            yield episodes, future.result()
