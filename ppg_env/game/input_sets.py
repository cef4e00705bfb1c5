r"""Control sets, constant or changing over time (the paper's U_it).

    u_t in U_k   for   first_k <= t < first_{k+1},     0 = first_0 < first_1 < ...

and the last set holds without end.  A constant set is written as one polytope.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env.errors import InputError, placed, require
from ppg_env.game.polytope import Polytope
from ppg_env.support.validation import is_whole

Controls = Polytope | tuple[tuple[int, Polytope], ...]
"""A polytope, or pairs (first step, polytope) in increasing order of steps, the first from 0."""

MOST_ROOM = 100.0
"""Cap on the result of :func:`room`; an input that fits so many times counts as zero."""

LONGEST_HORIZON = 10_000
"""Longest horizon of a game, and last step at which a set may change."""


def checked_controls(value: Any) -> Controls:
    """Return ``value`` as control sets; a single set becomes a polytope.

    Raises
    ------
    InputError
        If it is neither a polytope nor pairs of increasing steps and polytopes of one dimension.
    """
    if isinstance(value, Polytope):
        return value
    require(
        isinstance(value, (list, tuple)) and len(value) > 0,
        "control",
        "is not a polytope",
        "give a Polytope such as Polytope.box([20.0, 20.0]), or a list of (first step, Polytope)",
    )
    checked = tuple(_checked_piece(k, piece) for k, piece in enumerate(value))
    _check_sequence(checked)
    return checked if len(checked) > 1 else checked[0][1]


def _check_sequence(sets: tuple[tuple[int, Polytope], ...]) -> None:
    for k, (first, admissible) in enumerate(sets):
        place, before = f"control[{k}]", sets[k - 1][0] if k else -1
        require(k > 0 or first == 0, place, f"holds from step {first}", "start with step 0")
        require(
            before < first <= LONGEST_HORIZON,
            place,
            f"holds from step {first}, and the set before it from step {before}",
            f"write increasing steps up to {LONGEST_HORIZON}",
        )
        require(
            admissible.dim == sets[0][1].dim,
            place,
            f"has dimension {admissible.dim} where control[0] has {sets[0][1].dim}",
            "give sets of the same inputs",
        )


def _checked_piece(k: int, piece: Any) -> tuple[int, Polytope]:
    with placed(f"control[{k}]"):
        pair = isinstance(piece, (list, tuple)) and len(piece) == 2
        if not pair or not isinstance(piece[1], Polytope):
            raise InputError(
                "",
                "is not a step and a polytope",
                "write a pair such as (5, Polytope.box([10.0, 10.0]))",
            )
        first, admissible = piece
        whole = is_whole(first)
        require(whole, "", f"holds from step {first!r:.40}", "count steps in whole numbers from 0")
        return int(first), admissible


def pieces(control: Controls) -> tuple[tuple[int, Polytope], ...]:
    """Return pairs (first step, set), one pair for a constant set."""
    return control if isinstance(control, tuple) else ((0, control),)


def set_at(control: Controls, step: int) -> Polytope:
    """Return the set that holds at ``step``."""
    if isinstance(control, Polytope):
        return control
    return next(admissible for first, admissible in reversed(control) if first <= step)


def spans(control: Controls, steps: int) -> list[tuple[slice, Polytope]]:
    """Return the sets of steps 0..``steps`` - 1, each with the steps at which it holds."""
    sets = pieces(control)
    ends = [first for first, _ in sets[1:]] + [steps]
    return [
        (slice(first, min(end, steps)), admissible)
        for (first, admissible), end in zip(sets, ends, strict=True)
        if first < steps
    ]


def later(control: Controls, step: int) -> Controls:
    """Return the sets with time counted from ``step``."""
    if isinstance(control, Polytope):
        return control
    rest = [(first - step, admissible) for first, admissible in control if first > step]
    return checked_controls([(0, set_at(control, step)), *rest])


def clearance(control: Controls, inputs: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the largest a_p u - b_p (K,) of ``inputs`` (K, m), each in the set of its step.

    ``steps`` (K,) are the steps; values are negative inside, as for one polytope.
    """
    if isinstance(control, Polytope):
        return control.clearance(inputs)
    index = np.searchsorted([first for first, _ in control], steps, side="right") - 1
    result = np.empty(len(inputs))
    for k, (_, admissible) in enumerate(control):
        result[index == k] = admissible.clearance(inputs[index == k])
    return result


def excess(control: Controls, inputs: np.ndarray) -> float:
    """Return the largest distance of ``inputs`` (t, m), applied from step 0, beyond a face.

    It is negative if all are inside their sets, and -inf if there are none.
    """
    return float(clearance(control, inputs, np.arange(len(inputs))).max(initial=-np.inf))


def room(control: Controls, inputs: np.ndarray) -> np.ndarray:
    """Return how many times (t,) each of ``inputs`` (t, m), applied from step 0, fits in its set.

    Values are at most 100, and zero where the set lies on another side.
    """
    result = np.empty(len(inputs))
    for steps, admissible in spans(control, len(inputs)):
        along = inputs[steps] @ admissible.normals.T
        fits = np.full(along.shape, MOST_ROOM)
        with np.errstate(over="ignore"):  # an infinite ratio is clipped below
            np.divide(admissible.offsets, along, out=fits, where=along > 0)
        result[steps] = fits.min(axis=1).clip(0.0, MOST_ROOM)
    return result


def bounds(control: Controls) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest value (m,) of every input, over all sets."""
    low, high = zip(*(admissible.bounds for _, admissible in pieces(control)), strict=True)
    return np.min(low, axis=0), np.max(high, axis=0)
