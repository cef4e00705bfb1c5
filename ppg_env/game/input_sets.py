r"""Control sets, constant or changing over time (the paper's U_it).

    u_t in U_k   for   first_k <= t < first_{k+1},     0 = first_0 < first_1 < ...

and the last set holds for ever.  A constant set is written as one polytope.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env.errors import InputError, placed, require
from ppg_env.game.polytope import Polytope

Controls = Polytope | tuple[tuple[int, Polytope], ...]
"""A polytope, or pairs (first step, polytope) in the order of time, the first from step 0 on."""

MOST_ROOM = 100.0
"""An input that fits so many times is as good as zero: the others need not be made smaller."""

LATEST = 10_000
"""Last step at which a set may change: the longest horizon."""


def checked_controls(value: Any) -> Controls:
    """``value`` as control sets; one set alone is a polytope however it was written.

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
    found = tuple(_checked_piece(k, piece) for k, piece in enumerate(value))
    for k, (first, held) in enumerate(found):
        place, before = f"control[{k}]", found[k - 1][0] if k else -1
        require(k > 0 or first == 0, place, f"holds from step {first} on", "let it hold from 0 on")
        require(
            before < first <= LATEST,
            place,
            f"holds from step {first} on, and the one before from step {before}",
            f"let steps increase, up to {LATEST}",
        )
        require(
            held.dim == found[0][1].dim,
            place,
            f"has dimension {held.dim} where control[0] has {found[0][1].dim}",
            "give sets of the same inputs",
        )
    return found if len(found) > 1 else found[0][1]


def _checked_piece(k: int, piece: Any) -> tuple[int, Polytope]:
    with placed(f"control[{k}]"):
        pair = isinstance(piece, (list, tuple)) and len(piece) == 2
        if not pair or not isinstance(piece[1], Polytope):
            raise InputError(
                "",
                "is not a step and a polytope",
                "write a pair such as (5, Polytope.box([10.0, 10.0]))",
            )
        first, held = piece
        whole = isinstance(first, (int, np.integer)) and not isinstance(first, bool)
        require(
            whole, "", f"holds from step {first!r:.40} on", "count steps in whole numbers from 0"
        )
        return int(first), held


def pieces(control: Controls) -> tuple[tuple[int, Polytope], ...]:
    """Pairs of a set and the step from which it holds, whether the sets change or not."""
    return control if isinstance(control, tuple) else ((0, control),)


def set_at(control: Controls, step: int) -> Polytope:
    """The set that holds at a step."""
    if isinstance(control, Polytope):
        return control
    return next(held for first, held in reversed(control) if first <= step)


def spans(control: Controls, steps: int) -> list[tuple[slice, Polytope]]:
    """The sets of the steps 0..``steps`` - 1, each with the steps at which it holds."""
    known = pieces(control)
    ends = [first for first, _ in known[1:]] + [steps]
    return [
        (slice(first, min(end, steps)), held)
        for (first, held), end in zip(known, ends, strict=True)
        if first < steps
    ]


def later(control: Controls, step: int) -> Controls:
    """The sets as they are for whoever counts time from ``step`` on."""
    if isinstance(control, Polytope):
        return control
    rest = [(first - step, held) for first, held in control if first > step]
    return checked_controls([(0, set_at(control, step)), *rest])


def clearance(control: Controls, inputs: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """(K,) largest a_p u - b_p of each of ``inputs`` (K, m) in the set of its step, of ``steps``.

    Negative inside, as for one polytope.
    """
    if isinstance(control, Polytope):
        return control.clearance(inputs)
    begun = np.searchsorted([first for first, _ in control], steps, side="right") - 1
    result = np.empty(len(inputs))
    for k, (_, held) in enumerate(control):
        result[begun == k] = held.clearance(inputs[begun == k])
    return result


def excess(control: Controls, inputs: np.ndarray) -> float:
    """How far ``inputs`` (t, m), played from step 0 on, go at most beyond a face of their sets.

    Negative where all are inside; -inf where there are none.
    """
    return float(clearance(control, inputs, np.arange(len(inputs))).max(initial=-np.inf))


def room(control: Controls, inputs: np.ndarray) -> np.ndarray:
    """(t,) how many times each of ``inputs``, played from step 0 on, fits in its set; at most 100.

    Zero where the set lies on another side.
    """
    result = np.empty(len(inputs))
    for steps, held in spans(control, len(inputs)):
        along = inputs[steps] @ held.normals.T
        fits = np.divide(held.offsets, along, out=np.full(along.shape, MOST_ROOM), where=along > 0)
        result[steps] = fits.min(axis=1).clip(0.0, MOST_ROOM)
    return result


def bounds(control: Controls) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value (m,) of every input, over all sets."""
    low, high = zip(*(held.bounds for _, held in pieces(control)), strict=True)
    return np.min(low, axis=0), np.max(high, axis=0)
