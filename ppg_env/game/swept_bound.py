r"""An upper bound on the probability that two bodies overlap during the steps in traffic.

Let delta(t) be the displacement of an encounter, on straight lines between the instants, and
H = {a . delta <= b} a half-space that contains its collision set K: a face, or a supporting
half-space through a corner.  If delta is outside H at both ends of a step, it is outside K during
the whole step.  Hence, with a half-space H_t for every step t -> t + 1, t < n,

    {overlap during a step}  is a subset of  union over t of {delta(t) in H_t or delta(t+1) in H_t}.

The union bound counts an instant once where its two steps have the same half-space:

    Pr(overlap)  <=  sum_t Pr(delta(t+1) in H_t)  +  sum_{t in S} Pr(delta(t) in H_t),
    S = {0} and all t with H_t != H_(t-1).

Each term is a Gaussian tail.  Dynamic programming finds the cheapest sequence among candidates
(:mod:`ppg_env.game.supporting_halfspaces`).  They include all faces, so the bound is at most the
sum of 2 g(m(t)) that programs minimise.  It does not depend on the order of the pair, since
-delta and -K give the same tails, and margins are not capped.

The event is that of ``collisions="swept"``: bodies that follow their noisy closed loops and move
on straight lines between the instants, parked ones with the covariance of their arrival.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.margins import (
    encounter_covariances,
    ends_of_traffic,
    face_margins,
    mean_displacements,
    rests,
)
from ppg_env.game.plan import Profile
from ppg_env.game.supporting_halfspaces import supporting_halfspaces

TINY = float(np.finfo(float).tiny)
"""Replaces positive probabilities that are too small for a float."""

SMALLEST_TAIL = 1e-20
"""Steps that a face covers with a smaller probability get no other candidates, to save time."""


class Cover(NamedTuple):
    """K half-spaces at instants that cover the overlaps of one encounter, in order of time.

    Attributes
    ----------
    times : (K,) instants.
    normals, levels : (K, d) unit normals; (K,) distances of the means, in standard deviations.
    deviations : (K,) standard deviations along the normals; zero without noise.
    log_tails : (K,) logarithms of the probabilities.
    """

    times: np.ndarray
    normals: np.ndarray
    levels: np.ndarray
    deviations: np.ndarray
    log_tails: np.ndarray

    @property
    def bound(self) -> float:
        """The union bound; zero only if no noise leads to an overlap."""
        tails = np.exp(self.log_tails)
        return float(np.where(np.isneginf(self.log_tails), 0.0, np.maximum(tails, TINY)).sum())


def swept_covers(game: Game, profile: Profile) -> list[Cover]:
    """Return the cheapest covers, in the order of ``game.encounters``."""
    arrival = [plan.arrival for plan in profile]
    ends, means = ends_of_traffic(game, arrival), mean_displacements(game, profile)
    return [_cover(game, e, means[e], int(ends[e]), arrival) for e in range(len(game.encounters))]


def _cover(game: Game, e: int, means: np.ndarray, end: int, arrival: Sequence[int | None]) -> Cover:

    encounter, last = game.encounters[e], end + 1 if end else 0
    spread = encounter_covariances(game, encounter, rests(game, encounter, arrival))[:last]
    normals, offsets = encounter.collision.normals, encounter.collision.offsets
    faces = np.exp(_log_tails(normals, offsets, means[:last], spread)[2])
    likely = np.flatnonzero((faces[:-1] + faces[1:]).min(axis=1) > SMALLEST_TAIL)
    normals, offsets = supporting_halfspaces(normals, offsets, means, spread, likely)
    levels, deviations, logs = _log_tails(normals, offsets, means[:last], spread)
    times, chosen = _cheapest(np.exp(logs))
    picked = (times, chosen)
    return Cover(times, normals[chosen], levels[picked], deviations[picked], logs[picked])


def _log_tails(
    normals: np.ndarray, offsets: np.ndarray, means: np.ndarray, spread: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (K, C) levels, deviations and log probabilities of half-spaces at all instants."""
    from scipy.special import log_ndtr

    square = np.einsum("ci,tij,cj->tc", normals, spread, normals)
    deviations = np.sqrt(np.maximum(square, 0.0))
    levels = face_margins(means @ normals.T - offsets, deviations)
    return levels, deviations, log_ndtr(-levels)


def _cheapest(tails: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the instants and half-spaces of the cheapest cover from ``tails`` (n + 1, C).

    ``cost[c]`` is that of covering the steps so far if c covers the last one.
    """
    steps, count = max(len(tails) - 1, 0), tails.shape[1]
    cost, before = np.full(count, np.inf), np.empty((steps, count), dtype=np.int64)
    for t in range(steps):
        best = int(cost.argmin())
        changed = (cost[best] if t else 0.0) + tails[t]
        before[t] = np.where(cost <= changed, np.arange(count), best)
        cost = np.minimum(cost, changed) + tails[t + 1]
    times, chosen = [], []
    now = int(cost.argmin())
    for t in reversed(range(steps)):
        times.append(t + 1)
        chosen.append(now)
        if t == 0 or before[t, now] != now:
            times.append(t)
            chosen.append(now)
        now = int(before[t, now])
    return np.array(times[::-1], dtype=np.int64), np.array(chosen[::-1], dtype=np.int64)
