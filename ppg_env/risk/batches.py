"""Blocks of episodes: each has noise of its own, made from the seed and the block's number.

So results depend neither on the order in which blocks are finished nor on who finishes them, and
more episodes only add to fewer.
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

AHEAD = 4
"""Blocks that are under way per worker; bounds the memory, whatever the number of episodes."""

Result = TypeVar("Result")


class Scratch:
    """An array of one shape for each thread, used again by its next block.

    Asking the system for fresh memory costs more than the normals that are drawn into it.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._shape, self._local = shape, local()

    def __call__(self) -> np.ndarray:
        """The array of the thread that asks, with whatever is in it."""
        if not hasattr(self._local, "array"):
            self._local.array = np.empty(self._shape)
        array: np.ndarray = self._local.array
        return array


def check_request(samples: int, seed: int) -> None:
    """Refuse a number of samples or a seed that makes no sense."""
    require(samples >= 1, "samples", f"is {samples}", "ask for at least one episode")
    require(seed >= 0, "seed", f"is {seed}", "give a number that is not negative")


def generator(seed: int, *key: int) -> np.random.Generator:
    """The noise of one block."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=key)))


def over_blocks(
    function: Callable[[int, int], Result], samples: int, workers: int = 1
) -> Iterator[tuple[int, Result]]:
    """Yield, in order, each block's number of episodes and ``function(block, episodes)``.

    ``workers`` threads; NumPy and compiled code run in them at the same time.
    """
    blocks = -(-samples // BLOCK)
    jobs = ((b, min(BLOCK, samples - b * BLOCK)) for b in range(blocks))
    if workers == 1:
        for number, episodes in jobs:
            yield episodes, function(number, episodes)
        return
    with ThreadPoolExecutor(workers) as pool:
        waiting: deque[tuple[int, Future[Result]]] = deque()
        for number, episodes in jobs:
            waiting.append((episodes, pool.submit(function, number, episodes)))
            if len(waiting) >= AHEAD * workers:
                done, future = waiting.popleft()
                yield done, future.result()
        for done, future in waiting:
            yield done, future.result()
