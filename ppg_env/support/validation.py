"""Validation of numbers and matrices: each is converted, or refused in one sentence.

A number of a game is finite and at most :data:`ppg_env.tolerances.LARGEST` in absolute value.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.support.frozen import frozen_array


def finite_number(value: Any, place: str, remedy: str) -> float:
    """Return ``value`` as a float.

    Raises
    ------
    InputError
        If it is not a finite number of at most ``tol.LARGEST`` in absolute value.
    """
    ok = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    try:
        number = float(value) if ok else float("nan")
    except OverflowError:
        number = float("inf")
    require(bool(np.isfinite(number)), place, f"is {value!r:.40}, not a finite number", remedy)
    require(
        abs(number) <= tol.LARGEST, place, f"is {number:g}, too large for double arithmetic", remedy
    )
    return number


def is_whole(value: Any) -> bool:
    """Return whether ``value`` is a whole number; truth values are none."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def numbers(values: Any) -> np.ndarray:
    """Return ``values`` as a read-only float64 array.

    Raises
    ------
    ValueError
        If they are text, truth values, ragged lists, or too large for a double.
    """
    try:
        array = np.array(values)
    except (TypeError, OverflowError):
        raise ValueError from None
    if array.dtype.kind not in "iuf" and array.size:
        raise ValueError
    return frozen_array(array)


def finite_array(values: Any, place: str, remedy: str, largest: float = tol.LARGEST) -> np.ndarray:
    """Return ``values`` as a read-only float64 array.

    Raises
    ------
    InputError
        If they are not finite numbers of at most ``largest`` in absolute value.
    """
    try:
        array = numbers(values)
    except ValueError:
        raise InputError(place, "is not made of numbers", remedy) from None
    if not (np.abs(array) <= largest).all():  # also where an entry is not a number
        require(
            bool(np.isfinite(array).all()),
            place,
            "has an entry that is not a finite number",
            remedy,
        )
        require_size(float(np.abs(array).max()), place, largest)
    return array


def require_size(size: float, place: str, largest: float = tol.LARGEST) -> None:
    """Refuse a number whose absolute value is above ``largest``."""
    require(
        abs(size) <= largest,
        place,
        f"has the size {abs(size):.4g}, too large for double arithmetic",
        f"choose units in which it is at most {largest:g}",
    )


def matrix(
    values: Any, shape: tuple[int, int], place: str, largest: float = tol.LARGEST
) -> np.ndarray:
    """Return ``values`` as a read-only matrix of exactly this ``shape``."""
    remedy = f"write {shape[0]} rows of {shape[1]} numbers"
    array = finite_array(values, place, remedy, largest)
    require(
        array.shape == shape,
        place,
        f"is {shape_text(array)} where {shape[0]}x{shape[1]} is needed",
        remedy,
    )
    return array


def scalar_or_matrix(
    values: Any, shape: tuple[int, int], place: str, largest: float = tol.LARGEST
) -> np.ndarray:
    """Return ``values`` as a matrix of this ``shape``; a number k stands for k I."""
    rows = f"{shape[0]} rows of {shape[1]} numbers"
    array = finite_array(values, place, f"write one number, or {rows}", largest)
    if array.ndim == 0:
        require(
            shape[0] == shape[1] or float(array) == 0,
            place,
            f"is a number where a {shape[0]}x{shape[1]} matrix is needed",
            f"write {rows}",
        )
        return frozen_array(float(array) * np.eye(*shape))
    return matrix(array, shape, place, largest)


def covariance(values: Any, n: int, place: str) -> np.ndarray:
    """Return ``values`` as an (n, n) covariance; a number s stands for s I.

    Raises
    ------
    InputError
        If it is not symmetric, has a negative eigenvalue, or an entry beyond ``tol.LARGEST``
        squared.
    """
    matrix = scalar_or_matrix(values, (n, n), place, tol.LARGEST**2)
    largest = float(np.abs(matrix).max())
    scale = max(largest, np.finfo(float).tiny)
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
        f"is not a covariance: it has the eigenvalue {smallest:.4g}",
        remedy,
    )
    return matrix


def shape_text(array: np.ndarray) -> str:
    """Return the shape of ``array`` as a message writes it: ``2x3``."""
    return "x".join(str(size) for size in array.shape) or "a single number"
