r"""Units of length: results depend neither on the user's unit nor on where the origin lies.

Tolerances (:mod:`ppg_env.tolerances`) are lengths for bodies of the size of the paper's.  Every
agent has its own units, in which it looks like such an agent:

    length    the size of its body over the size of the paper's bodies
    state     for component k that moves component j by A_jk per step, that of j over |A_jk|
    control   for a control that moves component j by B_jk, that of j over |B_jk|
"""

from __future__ import annotations

import numpy as np

USUAL = 15.0
"""Size of the paper's bodies."""

NOISE = 1e-12
"""Entries of A and B below this share of the largest are rounding errors."""


def unit_of_size(size: float) -> float:
    """Return the unit of length of a body of this ``size``; 1 for a point."""
    return size / USUAL if size else 1.0


def units_of_state(A: np.ndarray, dim: int, length: float) -> np.ndarray:
    """Return (n,) the unit of every state component; the first ``dim`` are positions."""
    units = np.full(len(A), length)
    known = list(range(dim))
    for _ in range(len(A)):
        for k in set(range(len(A))) - set(known):
            moved = [units[j] / abs(A[j, k]) for j in known if _counts(A, j, k)]
            if moved:
                units[k] = min(moved)
                known.append(k)
    return units


def unit_of_control(B: np.ndarray, states: np.ndarray) -> float:
    """Return the unit of all controls, given the units of the ``states`` (n,) that they move."""
    entries = [(j, k) for j, k in np.ndindex(B.shape) if _counts(B, j, k)]
    moved = [states[j] / abs(B[j, k]) for j, k in entries]
    return float(min(moved, default=1.0))


def _counts(matrix: np.ndarray, j: int, k: int) -> bool:
    return bool(abs(matrix[j, k]) > NOISE * np.abs(matrix).max())
