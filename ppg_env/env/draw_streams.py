"""Uniform numbers of which each depends on the seed and on its own coordinates only.

The numbers that episode e of copy c draws are a hash of the seed, c, e and what is drawn.  They
depend neither on the other copies nor on the order in which episodes end.

Source of the hash: Steele, Lea & Flood, Fast splittable pseudorandom number generators (2014), in
the variant called SplitMix64.
"""

from __future__ import annotations

import numpy as np

GOLDEN = np.uint64(0x9E3779B97F4A7C15)

CHILD = 0x64726177
"""Key of the stream of draws among the children of a seed; noise comes from the seed itself."""


class DrawStreams:
    """The uniform numbers of one ``seed``."""

    def __init__(self, seed: np.random.SeedSequence) -> None:
        child = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, CHILD))
        self._key = child.generate_state(1, np.uint64)

    def uniform(
        self, copies: np.ndarray, episodes: np.ndarray, *words: int, size: int = 1
    ) -> np.ndarray:
        """Return numbers (M, size) in [0, 1) of M copies, each in its own episode."""
        bits = _mix(_mix(self._key + _words(copies)) + _words(episodes))
        for word in words:
            bits = _mix(bits + _words(np.array([word])))
        bits = _mix(bits[:, None] + _words(np.arange(size)))
        return np.asarray((bits >> np.uint64(11)) * 2.0**-53)


def _words(numbers: np.ndarray) -> np.ndarray:
    return (numbers.astype(np.uint64) + np.uint64(1)) * GOLDEN


def _mix(bits: np.ndarray) -> np.ndarray:
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return bits ^ (bits >> np.uint64(31))
