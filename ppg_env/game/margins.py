"""Encounters: who is in them, until when, and how wide their margins are.

The margin of a displacement is the best face's clearance, measured in units of its noise:

    s = max_p (a_p' (r_i - r_j) - b_p) / unit_p

A face without noise counts fully or not at all: plus infinity when it is clear (touching
included), minus infinity when it is not.  :mod:`ppg_env.game.compiled_margins` states the same
rule for compiled loops.

An encounter is a sequence of events t = 0, 1, ...: the instants t, or with ``collisions="swept"``
the steps t -> t + 1.  A face that is clear at both ends of a step is clear in between, so the
margin of a step is

    m(t) = max_p min(s_p(t), s_p(t+1)).

Sizes: N agents, E encounters, F faces of an encounter, d position components, times 0..H.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.dynamics import covariances
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan, Profile


class CollisionFaces(NamedTuple):
    """Faces of all collision sets, one encounter after the other.

    Attributes
    ----------
    normals, offsets : (faces, d) unit normals and (faces,) offsets.
    depths : (faces,) offsets less the tolerance within which bodies only touch.
    first : (E + 1,) first face of each encounter, and the number of faces.
    """

    normals: np.ndarray
    offsets: np.ndarray
    depths: np.ndarray
    first: np.ndarray


def collision_faces(game: Game, encounters: Sequence[Encounter] | None = None) -> CollisionFaces:
    """Return the faces of the collision sets of ``encounters``, by default all of the game."""
    sets = [e.collision for e in (game.encounters if encounters is None else encounters)]
    offsets = np.concatenate([np.zeros(0), *(collision.offsets for collision in sets)])
    return CollisionFaces(
        normals=np.concatenate([np.zeros((0, game.dim)), *(c.normals for c in sets)]),
        offsets=offsets,
        depths=offsets - tol.LENGTH * game.unit,
        first=np.cumsum([0, *(len(collision.offsets) for collision in sets)], dtype=np.int64),
    )


def encounter_pairs(game: Game) -> np.ndarray:
    """Return (E, 2) agents i and j of each encounter; j = -1 for an obstacle."""
    pairs = [(*encounter.agents, -1)[:2] for encounter in game.encounters]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


@lru_cache(maxsize=256)
def membership(game: Game) -> np.ndarray:
    """Return (N, E) whether an agent takes part in an encounter, read-only."""
    result = np.zeros((len(game.agents), len(game.encounters)), dtype=bool)
    for e, encounter in enumerate(game.encounters):
        result[list(encounter.agents), e] = True
    result.setflags(write=False)
    return result


def end_of_traffic(
    game: Game, encounter: Encounter, arrival: Sequence[int | None] | Mapping[int, int | None]
) -> int:
    """Return the first event of an encounter that is out of traffic, at most H + 1 (swept: H).

    It is the earliest ``arrival`` of its agents; where bodies stay at their goals, it is the
    latest, that of a moving obstacle included.  None is no arrival.  An obstacle that is gone from
    some time on ends its encounters then.
    """
    last = game.horizon + (game.collisions == "instants")
    times = [last if (t := arrival[i]) is None else t for i in encounter.agents]
    until = last
    if encounter.obstacle is not None:
        obstacle = game.obstacles[encounter.obstacle]
        until = min(last, last if obstacle.until is None else obstacle.until)
        if game.on_goal == "stay":
            times.append(obstacle.rest)
    end = max(times) if game.on_goal == "stay" else min(times)
    return min(end, until)


def ends_of_traffic(game: Game, arrival: Sequence[int | None]) -> np.ndarray:
    """Return (E,) the :func:`end_of_traffic` of every encounter."""
    ends = [end_of_traffic(game, encounter, arrival) for encounter in game.encounters]
    return np.array(ends, dtype=np.int64)


def in_traffic(game: Game, arrival: Sequence[int | None]) -> np.ndarray:
    """Return (E, H+1) whether each encounter is in traffic at each event."""
    return np.arange(game.horizon + 1) < ends_of_traffic(game, arrival)[:, None]


def rests(
    game: Game, encounter: Encounter, arrival: Sequence[int | None] | Mapping[int, int | None]
) -> tuple[int, ...]:
    """Return the time from which each agent's errors stay as they are, H if it is removed then."""
    if game.on_goal == "remove":
        return (game.horizon,) * len(encounter.agents)
    times = (arrival[i] for i in encounter.agents)
    return tuple(game.horizon if t is None else min(t, game.horizon) for t in times)


def encounter_covariances(
    game: Game, encounter: Encounter, rest: tuple[int, ...] | None = None
) -> np.ndarray:
    """Return (H+1, d, d) covariances of the displacement, Sigma_i + Sigma_j.

    Those of an agent stay what they are at its ``rest`` (default: the horizon).
    """
    positions = np.s_[:, : game.dim, : game.dim]
    total = np.zeros((game.horizon + 1, game.dim, game.dim))
    times = np.arange(game.horizon + 1)
    for i, last in zip(encounter.agents, rest or (game.horizon,) * 2, strict=False):
        total += covariances(game.agents[i], game.horizon)[np.minimum(times, last)][positions]
    if encounter.obstacle is not None:
        total += game.obstacles[encounter.obstacle].covariances(game.horizon)
    return total


def encounter_deviations(
    game: Game, encounter: Encounter, rest: tuple[int, ...] | None = None
) -> np.ndarray:
    """Return (H+1, F) sigma_p(t), the deviation of the displacement along each face of K."""
    normals, total = encounter.collision.normals, encounter_covariances(game, encounter, rest)
    return np.sqrt(np.maximum(np.einsum("fi,tij,fj->tf", normals, total, normals), 0.0))


@lru_cache(maxsize=8192)
def encounter_units(
    game: Game, encounter: Encounter, rest: tuple[int, ...] | None = None
) -> np.ndarray:
    """Return (H+1, F) lengths of one unit of margin; zero where there is no noise.

    A unit is sqrt(2) sigma_p(t), or sigma_p(t) on paper scale.  The array is read-only, since it
    is shared by all plans with the same ``rest`` (:func:`rests`).
    """
    scale = np.sqrt(2) if game.scale == "exact" else 1.0
    unit = encounter_deviations(game, encounter, rest) * scale
    unit = np.where(unit > tol.DEVIATION * game.unit, unit, 0.0)
    unit.setflags(write=False)
    return unit


def mean_displacements(game: Game, profile: Profile) -> np.ndarray:
    """Return (E, H+1, d) displacements of the plans' means in every encounter."""
    means = [plan.means[:, : game.dim] for plan in profile]
    rows = [
        e.displacement(*(means[i] for i in e.agents)) - game.obstacle_positions(e)
        for e in game.encounters
    ]
    return np.array(rows).reshape(len(rows), game.horizon + 1, game.dim)


def profile_margins(game: Game, profile: Profile) -> np.ndarray:
    """Return (E, H+1) margins min(M', m) of all events along the means, in traffic or not."""
    return margins_and_overlaps(game, profile)[0]


def margins_and_overlaps(game: Game, profile: Profile) -> tuple[np.ndarray, np.ndarray]:
    """Return margins (E, H+1) and overlaps (E,) of :func:`plan_margins` of all encounters."""
    count = len(game.encounters)
    margins, overlaps = np.empty((count, game.horizon + 1)), np.empty(count)
    for e, encounter in enumerate(game.encounters):
        plans = tuple(profile[i] for i in encounter.agents)
        margins[e], overlaps[e] = plan_margins(game, e, plans)
    return margins, overlaps


@lru_cache(maxsize=16384)
def plan_margins(game: Game, index: int, plans: tuple[Plan, ...]) -> tuple[np.ndarray, float]:
    """Return the margins of an encounter along the ``plans`` of its agents, and its overlap.

    The margins (H+1,) are min(M', m) of all events, in traffic or not, read-only.  With
    ``collisions="swept"`` the last one is at the cap: no step starts at the horizon.  The overlap
    is the largest penetration of the means in traffic, of the best face during a step, at least 0.
    Planners change one plan at a time, so values are cached.
    """
    encounter, normals = game.encounters[index], game.encounters[index].collision.normals
    arrival = dict(zip(encounter.agents, (plan.arrival for plan in plans), strict=True))
    where = encounter.displacement(*(plan.means[:, : game.dim] for plan in plans))
    where = where - game.obstacle_positions(encounter)
    clear = where @ normals.T - encounter.collision.offsets
    units = encounter_units(game, encounter, rests(game, encounter, arrival))
    margins = event_margins(game, clear, units)
    margins.setflags(write=False)
    during = over_events(game, clear).max(axis=1)[: end_of_traffic(game, encounter, arrival)]
    return margins, max(0.0, -float(during.min(initial=0.0)))


def event_margins(game: Game, clearances: np.ndarray, units: np.ndarray) -> np.ndarray:
    """Return (K,) capped margins of events from ``clearances`` and ``units`` (K, F) at instants."""
    faces = face_margins(clearances, units, game.unit)
    best = np.minimum(over_events(game, faces).max(axis=-1), game.margin_cap)
    if game.collisions == "swept":
        best = np.append(best, game.margin_cap)
    return best


def over_events(game: Game, values: np.ndarray) -> np.ndarray:
    """Return what ``values`` (K, F) at instants guarantee during events.

    Those are the values themselves, or the lower one at the ends of each of the K - 1 steps.
    """
    return values if game.collisions == "instants" else np.minimum(values[:-1], values[1:])


def face_margins(clearances: np.ndarray, units: np.ndarray, length: float = 1.0) -> np.ndarray:
    """Return (...,) ``clearances`` measured in ``units``, face by face.

    A face whose unit is zero has no noise: its margin is plus infinity when it is clear and minus
    infinity when it is not, with the tolerance of touching bodies for a unit of ``length``.
    """
    certain = np.where(clearances >= -tol.LENGTH * length, np.inf, -np.inf)
    return np.divide(clearances, units, out=certain, where=units > 0)


def margins(clearances: np.ndarray, units: np.ndarray, cap: float) -> np.ndarray:
    """Return (...,) min(cap, best face) of ``clearances`` (..., F) measured in ``units``."""
    return np.minimum(face_margins(clearances, units).max(axis=-1), cap)
