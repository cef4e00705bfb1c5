"""Seeds of noise and draws, checked alike in all views of a game."""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env.errors import require
from ppg_env.support.validation import is_whole

REMEDY = "give a whole number that is not negative"


def whole_seed(seed: Any) -> int:
    """Return ``seed`` as an int.

    Raises
    ------
    InputError
        If it is no whole number, or negative.
    """
    require(is_whole(seed) and seed >= 0, "seed", f"is {seed!r:.60}", REMEDY)
    return int(seed)


def seed_sequence(seed: Any) -> np.random.SeedSequence:
    """Return the sequence of a whole number, of several, or of None (fresh entropy).

    Raises
    ------
    InputError
        If ``seed`` is none of these, and no ``SeedSequence`` either.
    """
    if seed is None or isinstance(seed, np.random.SeedSequence):
        return np.random.SeedSequence() if seed is None else seed
    if isinstance(seed, (list, tuple)) or (isinstance(seed, np.ndarray) and seed.ndim == 1):
        require(len(seed) > 0, "seed", "is an empty sequence", REMEDY)
        return np.random.SeedSequence([whole_seed(number) for number in seed])
    return np.random.SeedSequence(whole_seed(seed))
