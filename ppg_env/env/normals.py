"""Standard normals of a NumPy generator, drawn by compiled code where that gives the same ones.

Numbers and the state of the generator afterwards are those of ``generator.standard_normal``.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

TRIAL = 4096
"""Numbers that must agree with NumPy's; forty of them take the rare branches."""


class Normals:
    """Draws from whichever generator it is given; it keeps track of the last one."""

    def __init__(self) -> None:
        self._generator: Any = None
        self._words: np.ndarray | None = None

    def __reduce__(self) -> tuple[type[Normals], tuple[()]]:
        return Normals, ()  # the words are the memory of another generator

    def fill(self, generator: Any, out: np.ndarray) -> np.ndarray:
        """Fill ``out`` (C, bodies, n) and return it."""
        if generator is not self._generator:
            self._generator, self._words = generator, _words(generator)
        fill = compiled_fill()
        if fill is None or self._words is None:
            generator.standard_normal(out=out)
        else:
            fill(self._words, out)
        return out


def _words(generator: Any) -> np.ndarray | None:
    """Return the state (4,) of an SFC64 generator, a view; None where it has no such thing."""
    bits = getattr(generator, "bit_generator", None)
    if type(bits) is not np.random.SFC64 or compiled_fill() is None:
        return None
    return _memory(bits)


def _memory(bits: np.random.SFC64) -> np.ndarray:
    """Return the first four words of the memory of ``bits``, a view."""
    words = (ctypes.c_uint64 * 4).from_address(bits.ctypes.state_address)
    return np.ctypeslib.as_array(words)


@lru_cache(maxsize=1)
def compiled_fill() -> Callable[[np.ndarray, np.ndarray], None] | None:
    """Return :func:`ppg_env.env.ziggurat.fill_normals`, None if it differs from NumPy.

    It relies on where NumPy keeps the state, and on tables that Numba holds; other releases of
    either may differ.
    """
    try:
        from ppg_env.env.ziggurat import fill_normals
    except ImportError:
        return None
    ours, theirs = (np.random.SFC64(1) for _ in range(2))
    words, out = _memory(ours), np.empty((1, 1, TRIAL))
    if not np.array_equal(words, ours.state["state"]["state"]):
        return None
    fill_normals(words, out)
    expected = np.random.Generator(theirs).standard_normal(TRIAL)
    same = np.array_equal(out.ravel(), expected) and str(ours.state) == str(theirs.state)
    return fill_normals if same else None
