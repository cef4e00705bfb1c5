"""Numbers and matrices at the door: converted, checked, or refused in one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.support.frozen import frozen_array


def finite_number(value: Any, place: str, remedy: str) -> float:
    """A finite float, or an :class:`InputError` at ``place``."""
    ok = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    try:
        number = float(value) if ok else float("nan")
    except OverflowError:
        number = float("inf")
    require(bool(np.isfinite(number)), place, f"is {value!r:.40}, not a finite number", remedy)
    return number


def numbers(values: Any) -> np.ndarray:
    """A read-only float64 array; text, truth values and ragged lists are not numbers.

    Raises
    ------
    ValueError
        If ``values`` are not numbers, or too large for one.
    """
    try:
        array = np.array(values)
    except (TypeError, OverflowError):
        raise ValueError from None
    if array.dtype.kind not in "iuf" and array.size:
        raise ValueError
    return frozen_array(array)


def finite_array(values: Any, place: str, remedy: str) -> np.ndarray:
    """A read-only array of finite numbers, or an :class:`InputError` at ``place``."""
    try:
        array = numbers(values)
    except ValueError:
        raise InputError(place, "is not made of numbers", remedy) from None
    require(
        bool(np.isfinite(array).all()), place, "has an entry that is not a finite number", remedy
    )
    return array


def matrix(values: Any, shape: tuple[int, int], place: str) -> np.ndarray:
    """A read-only matrix of exactly this ``shape``."""
    remedy = f"write {shape[0]} rows of {shape[1]} numbers"
    array = finite_array(values, place, remedy)
    size = "x".join(str(k) for k in array.shape) or "a single number"
    require(array.shape == shape, place, f"is {size} where {shape[0]}x{shape[1]} is due", remedy)
    return array


def scalar_or_matrix(values: Any, shape: tuple[int, int], place: str) -> np.ndarray:
    """A matrix of this ``shape``; a number k stands for k I."""
    remedy = f"write one number, or {shape[0]} rows of {shape[1]} numbers"
    array = finite_array(values, place, remedy)
    if array.ndim == 0:
        require(
            shape[0] == shape[1] or float(array) == 0,
            place,
            f"is a number where a {shape[0]}x{shape[1]} matrix is due",
            f"write {shape[0]} rows of {shape[1]} numbers",
        )
        return frozen_array(float(array) * np.eye(*shape))
    return matrix(array, shape, place)


def covariance(values: Any, n: int, place: str) -> np.ndarray:
    """An (n, n) symmetric matrix without negative eigenvalues; a number s stands for s I."""
    matrix = scalar_or_matrix(values, (n, n), place)
    scale = max(float(np.abs(matrix).max()), tol.DEVIATION)
    remedy = "write a symmetric matrix without negative eigenvalues, such as [[1.9, 0], [0, 1.9]]"
    require(
        bool(np.abs(matrix - matrix.T).max() <= tol.SYMMETRY * scale),
        place,
        "is not symmetric",
        remedy,
    )
    smallest = float(np.linalg.eigvalsh(matrix)[0])
    require(
        smallest >= -tol.SYMMETRY * scale,
        place,
        f"is no covariance: it has the eigenvalue {smallest:.4g}",
        remedy,
    )
    return matrix
