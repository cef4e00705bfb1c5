"""Tables of the probability that a body meets sets during a step, over its states.

A hazard is a collision set with the motion of the other body: its displacement is x - o before the
step and y + w - p after it.  The probability of meeting any of several hazards is computed as if
they were independent.  At instants it depends on y alone and is bilinear between points a part of
a standard deviation apart.  For swept collisions it depends on x too, and is bilinear in both;
points x inside a set count as the nearest point outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from ppg_env.game.dynamics import square_root
from ppg_env.game.polytope import Polytope
from ppg_env.support.compilation import njit
from solvers.feedback.events.sharp_events import overlap_probability, swept_probability
from solvers.feedback.grid.state_grid import AXES, padded

FINENESS, SWEPT_FINENESS = 8.0, 3.0
"""Points per standard deviation, at instants and for swept collisions."""

FARTHEST = 7.0
"""Standard deviations beyond a set at which probabilities are zero."""

LARGEST = 1500
"""Most points per axis."""

OUTSIDE = 1e-6
"""Distance to a face of starts that are moved out of a set."""


NODES, NODE_WEIGHTS = np.array([-np.sqrt(3.0), 0.0, np.sqrt(3.0)]), np.array([1, 4, 1]) / 6
"""Quadrature of a standard normal, for the place of a body before a swept step."""


@dataclass(frozen=True)
class Hazard:
    """A collision set, and where the other body is before and after the step.

    Attributes
    ----------
    collision : the displacements at which bodies overlap.
    before, after : (d,) mean positions of the other body.
    spread : (d, d) covariance of its position before the step.
    carry, noise : (d, d) how its error before the step continues, and the covariance of what the
        step adds.
    """

    collision: Polytope
    before: np.ndarray
    after: np.ndarray
    spread: np.ndarray
    carry: np.ndarray
    noise: np.ndarray

    @property
    def end(self) -> np.ndarray:
        """(d, d) covariance of its position after the step."""
        return np.asarray(self.carry @ self.spread @ self.carry.T + self.noise)


def fixed_hazard(collision: Polytope) -> Hazard:
    """Return the hazard of a body that rests at the origin."""
    origin, none = np.zeros(collision.dim), np.zeros((collision.dim, collision.dim))
    return Hazard(collision, origin, origin, none, np.eye(collision.dim), none)


class Events(NamedTuple):
    """Probabilities as the kernels take them.

    low, step (2,): points of the last positions y, the first ones of the row of the first start
    for swept collisions; values (P, Q): at instants; start_low, start_step (2,): points x;
    ratio (2,): points y per distance of points x; swept_values (n0, n1, P, Q): in row (i, j) for
    the points from (i, j) ratio on; swept: which of them holds; removes:
    crashed agents leave; parks: arrived bodies stay; empty: no hazard.
    """

    low: np.ndarray
    step: np.ndarray
    values: np.ndarray
    start_low: np.ndarray
    start_step: np.ndarray
    ratio: np.ndarray
    swept_values: np.ndarray
    swept: bool
    removes: bool
    parks: bool
    empty: bool


def no_events() -> Events:
    """Return the table of no hazard."""
    one = np.ones(AXES)
    return Events(one, one, np.zeros((1, 1)), one, one, one.astype(np.int64),
                  np.zeros((1, 1, 1, 1), np.float32), False, True, False, True)  # fmt: skip


def instant_events(hazards: Sequence[Hazard], covariance: np.ndarray) -> Events:
    """Return the table of overlaps at the end of a step; ``covariance`` (d, d) is that of w."""
    d = len(covariance)
    deviation = np.sqrt(np.diag(covariance))
    low, high = _extent(hazards, deviation, np.zeros(d), "after")
    counts = np.ceil((high - low) / np.maximum(deviation / FINENESS, (high - low) / LARGEST))
    counts = counts.astype(int)
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
    means = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    free = np.ones(means.shape[:-1])
    for hazard in hazards:
        free *= 1.0 - overlap_probability(
            hazard.collision, means - hazard.after, covariance + hazard.end
        )
    step = np.ones(AXES)
    step[:d] = (high - low) / counts
    values = np.ascontiguousarray((1.0 - free).reshape((*free.shape, 1)[:AXES]))
    return no_events()._replace(low=padded(low), step=step, values=values, empty=False)


def swept_events(
    hazards: Sequence[Hazard],
    covariance: np.ndarray,
    start_step: np.ndarray,
    anchor: np.ndarray,
    reach: np.ndarray,
) -> Events:
    """Return the table of crossings during a step.

    ``start_step`` and ``anchor`` (d,) are the distance of points x and one of them, ``reach`` (d,)
    the largest change of position in a step without noise.
    """
    d = len(covariance)
    deviation = np.sqrt(np.diag(covariance))
    low, high = _extent(hazards, deviation, reach, "before")
    low = anchor + np.floor((low - anchor) / start_step) * start_step
    counts = np.ceil((high - low) / start_step).astype(int) + 1
    fine = np.maximum(deviation / SWEPT_FINENESS, start_step / 8)
    ratio = np.maximum(np.ceil(start_step / fine), 1).astype(np.int64)
    fine = start_step / ratio
    room = np.ceil((reach + start_step) / fine).astype(int)
    offsets = [fine[k] * np.arange(-room[k], room[k] + 1) for k in range(d)]
    window = np.stack(np.meshgrid(*offsets, indexing="ij"), axis=-1)
    starts = [low[k] + start_step[k] * np.arange(counts[k]) for k in range(d)]
    values = np.zeros((*counts, *window.shape[:-1]), dtype=np.float32)
    for place in np.ndindex(*counts):
        start = np.array([starts[k][place[k]] for k in range(d)])
        values[place] = _crossing(hazards, start, start + window, covariance)
    if d == 1:
        values = values[:, None, :, None]
    ones = np.ones(AXES)
    return no_events()._replace(
        low=padded(low - room * fine),
        step=_filled(ones, fine),
        start_low=padded(low),
        start_step=_filled(ones, start_step),
        ratio=_filled(ones, ratio).astype(np.int64),
        swept_values=np.ascontiguousarray(values),
        swept=True,
        empty=False,
    )


def _filled(ones: np.ndarray, values: np.ndarray) -> np.ndarray:
    result = ones.copy()
    result[: len(values)] = values
    return result


def _extent(
    hazards: Sequence[Hazard], deviation: np.ndarray, reach: np.ndarray, side: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the box (d,), (d,) of positions from which a hazard can be met."""
    spreads = [np.diag(h.spread if side == "before" else h.end) for h in hazards]
    room = FARTHEST * np.sqrt(deviation**2 + np.max(spreads, axis=0)) + reach + OUTSIDE
    boxes = [
        np.stack(h.collision.bounds) + (h.before if side == "before" else h.after) for h in hazards
    ]
    drift = np.max([np.abs(h.after - h.before) for h in hazards], axis=0)
    low = np.min([box[0] for box in boxes], axis=0) - room
    high = np.max([box[1] for box in boxes], axis=0) + room
    return (low - drift, high + drift) if side == "before" else (low, high)


def _crossing(
    hazards: Sequence[Hazard], start: np.ndarray, means: np.ndarray, covariance: np.ndarray
) -> np.ndarray:
    """Return the probabilities (...) of meeting any hazard from ``start`` (d,)."""
    free = np.ones(means.shape[:-1])
    for hazard in hazards:
        met, noise = np.zeros(means.shape[:-1]), covariance + hazard.noise
        for weight, error in _errors(hazard.spread):
            before, after = start - hazard.before - error, means - hazard.after
            depth = hazard.collision.normals @ before - hazard.collision.offsets
            face = int(depth.argmax())
            if depth[face] < OUTSIDE:
                before = before + (OUTSIDE - depth[face]) * hazard.collision.normals[face]
            after = after - hazard.carry @ error
            met += weight * swept_probability(hazard.collision, before, after, noise)
        free *= 1.0 - met
    return 1.0 - free


def _errors(spread: np.ndarray) -> list[tuple[float, np.ndarray]]:
    """Return weights and nodes (d,) of a normal with covariance ``spread`` (d, d)."""
    if not spread.any():
        return [(1.0, np.zeros(len(spread)))]
    root, d = square_root(spread), len(spread)
    return [
        (float(np.prod(NODE_WEIGHTS[list(k)])), root @ NODES[list(k)])
        for k in product(range(len(NODES)), repeat=d)
    ]


@njit(cache=True)
def chance(events, x0, x1, y0, y1):
    """Return the probability for positions x before and y after the step; zero far away."""
    if events.empty:
        return 0.0
    if not events.swept:
        a, b = (y0 - events.low[0]) / events.step[0], (y1 - events.low[1]) / events.step[1]
        return bilinear(events.values, a, b, False)
    return swept_chance(events, x0, x1, y0, y1)


@njit(cache=True)
def swept_chance(events, x0, x1, y0, y1):
    """Return the probability of a crossing between positions x and y; zero far away."""
    rows, columns = events.swept_values.shape[:2]
    f0 = (x0 - events.start_low[0]) / events.start_step[0]
    f1 = (x1 - events.start_low[1]) / events.start_step[1] if columns > 1 else 0.0
    if f0 < 0.0 or f0 > rows - 1 or f1 < 0.0 or f1 > columns - 1:
        return 0.0
    i, j = min(int(f0), max(rows - 2, 0)), min(int(f1), max(columns - 2, 0))
    g0 = (y0 - events.low[0]) / events.step[0]
    g1 = (y1 - events.low[1]) / events.step[1] if columns > 1 else 0.0
    value = 0.0
    for a in range(2):
        wa = f0 - i if a == 1 else 1.0 - (f0 - i)
        if wa == 0.0:
            continue
        for b in range(2):
            wb = f1 - j if b == 1 else 1.0 - (f1 - j)
            if wb != 0.0:
                value += wa * wb * bilinear(
                    events.swept_values[i + a, j + b], g0 - (i + a) * events.ratio[0],
                    g1 - (j + b) * events.ratio[1] if columns > 1 else 0.0, True,
                )  # fmt: skip
    return value


@njit(cache=True)
def bilinear(values, a, b, clamped):
    """Return the value at the place (a, b) of a table; beyond it zero, or as on its border."""
    rows, columns = values.shape
    if clamped:
        a, b = min(max(a, 0.0), rows - 1.0), min(max(b, 0.0), columns - 1.0)
    elif a < 0.0 or a > rows - 1 or (columns > 1 and (b < 0.0 or b > columns - 1)):
        return 0.0
    i = min(int(a), max(rows - 2, 0))
    s = a - i
    if columns == 1:
        return (1.0 - s) * values[i, 0] + s * values[i + 1, 0]
    j = min(int(b), columns - 2)
    t = b - j
    return (1.0 - s) * ((1.0 - t) * values[i, j] + t * values[i, j + 1]) + s * (
        (1.0 - t) * values[i + 1, j] + t * values[i + 1, j + 1]
    )


def chances(events: Events, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return (K0, K1) the probabilities for bodies that rest at ``first`` and ``second``."""
    out = np.empty((len(first), len(second)))
    _all_pairs(events, first, second, out)
    return out


def chances_of(events: Events, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return (M,) the probabilities for moves from ``before`` to ``after`` (M, 2)."""
    out = np.empty(len(before))
    _all_moves(events, before, after, out)
    return out


@njit(cache=True)
def _all_pairs(events, first, second, out):
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            x0, x1 = first[i, 0] - second[j, 0], first[i, 1] - second[j, 1]
            out[i, j] = chance(events, x0, x1, x0, x1)


@njit(cache=True)
def _all_moves(events, before, after, out):
    for k in range(out.size):
        out[k] = chance(events, before[k, 0], before[k, 1], after[k, 0], after[k, 1])
