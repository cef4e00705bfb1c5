r"""Presolve: decide from the reachable sets what they determine, once arrivals are fixed.

A presolved encounter keeps the events (instants or steps, see :mod:`ppg_env.game.margins`) whose
margins depend on the plans, and the faces that can be reached there; at all other events the margin
is at its cap, or fixed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game import objective
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.margins import (
    encounter_units,
    end_of_traffic,
    face_margins,
    over_events,
    rests,
)
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Plan
from solvers.engine.reachability_bounds import Reach, reach_of


@dataclass(frozen=True)
class Subproblem:
    """An objective, the agents that plan, and the plans of the other agents."""

    objective: Objective
    movers: tuple[int, ...]
    given: Mapping[int, Plan]

    @property
    def game(self) -> Game:
        """The game of the objective."""
        return self.objective.game

    @cached_property
    def encounters(self) -> tuple[int, ...]:
        """Indices of the encounters that involve a mover."""
        movers = set(self.movers)
        return tuple(e for e, one in enumerate(self.game.encounters) if movers & set(one.agents))


@dataclass(frozen=True)
class PresolvedEncounter:
    """The undecided part of one encounter, for given arrivals.

    Attributes
    ----------
    index : index in ``game.encounters``.
    rest : times from which the errors of its agents stay as they are.
    times : (K,) undecided events.
    faces : (K, F) whether a face can be reached.
    most : (K, F) largest margin of each face within reach.
    cap : (K,) largest margin within reach.
    fixed_loss : loss at all other events in traffic, which no plan changes.
    least : lower bound on the loss at ``times``.
    """

    index: int
    rest: tuple[int, ...]
    times: np.ndarray
    faces: np.ndarray
    most: np.ndarray
    cap: np.ndarray
    fixed_loss: float
    least: float


def presolve_encounters(
    subproblem: Subproblem,
    encounters: Iterable[int],
    arrivals: Mapping[int, int],
    counted: Mapping[int, int] | None = None,
) -> list[PresolvedEncounter] | None:
    """Return :func:`presolve_encounter` of several encounters; None if one is infeasible."""
    results = [
        presolve_encounter(subproblem.game, e, arrivals, subproblem.given, counted)
        for e in encounters
    ]
    feasible = [result for result in results if result is not None]
    return feasible if len(feasible) == len(results) else None


def presolve_encounter(
    game: Game,
    index: int,
    arrivals: Mapping[int, int],
    given: Mapping[int, Plan],
    counted: Mapping[int, int] | None = None,
) -> PresolvedEncounter | None:
    """Presolve encounter ``index`` for movers that arrive at ``arrivals``; others are ``given``.

    The encounter is in traffic as if they arrived at ``counted``, which is ``arrivals`` by default.
    The result is None if the reachable sets exclude that the bodies keep apart.
    """
    encounter, ends = game.encounters[index], arrivals if counted is None else counted
    planned = {i: ends[i] if i in ends else given[i].arrival for i in encounter.agents}
    low, high = _clearances(game, encounter, arrivals, given, instants(game, encounter, planned))
    return presolve_within(game, index, rests(game, encounter, planned), low, high)


def presolve_within(
    game: Game, index: int, rest: tuple[int, ...], low: np.ndarray, high: np.ndarray
) -> PresolvedEncounter | None:
    """Presolve encounter ``index`` whose faces have clearances (K, F) from ``low`` to ``high``.

    ``rest`` are the times from which errors stay as they are.
    """
    encounter = game.encounters[index]
    units, cap = encounter_units(game, encounter, rest)[: len(low)], game.margin_cap
    faces = over_events(game, high) >= -tol.LENGTH
    if not faces.any(axis=1).all():
        return None
    most = np.clip(over_events(game, face_margins(high, units)), 0.0, cap)
    ceiling = most.max(axis=1, initial=0.0)
    floor = over_events(game, face_margins(low, units)).max(axis=1, initial=-np.inf)
    spread = -over_events(game, low - high)
    fixed = spread.max(axis=1, initial=0.0) <= tol.LENGTH / 10
    undecided = (floor < cap) & ~fixed
    fixed_loss = np.where(floor >= cap, cap, ceiling)[~undecided]
    chosen = np.flatnonzero(undecided)
    return PresolvedEncounter(
        index,
        rest,
        chosen,
        faces[chosen],
        most[chosen],
        ceiling[chosen],
        float(objective.loss(game, fixed_loss).sum()),
        float(objective.loss(game, ceiling[chosen]).sum()),
    )


def instants(game: Game, encounter: Encounter, planned: Mapping[int, int | None]) -> int:
    """Return the number of instants that the events of an encounter in traffic depend on."""
    events = end_of_traffic(game, encounter, planned)
    return events + 1 if events and game.collisions == "swept" else events


def _clearances(
    game: Game,
    encounter: Encounter,
    arrivals: Mapping[int, int],
    given: Mapping[int, Plan],
    count: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds (count, F) of the clearance a_p'(r_i - r_j) - b_p of every face."""
    normals, offsets = encounter.collision.faces
    still = game.obstacle_positions(encounter)[:count] @ normals.T + offsets
    low = high = -still
    for i, sign in zip(encounter.agents, (1.0, -1.0), strict=False):
        if i in arrivals:
            below, above = _reach(game, encounter, i).bounds(arrivals[i], count)
        else:
            below = above = given[i].means[:count, : game.dim] @ normals.T
        near, far = sign * below, sign * above
        low, high = low + np.minimum(near, far), high + np.maximum(near, far)
    return low, high


def matters(game: Game, index: int, mover: int, other: Plan, latest: int) -> bool:
    """Return whether a plan of ``mover`` that arrives by ``latest`` can come near ``other``.

    If not, the margin of their encounter is at its cap for every plan of the mover.
    """
    encounter = game.encounters[index]
    planned = dict.fromkeys(encounter.agents, other.arrival) | {mover: latest}
    count = instants(game, encounter, planned)
    if count <= 0:
        return False
    below, above = _anywhere(game, index, mover, latest, count)
    means = other.means[:count, : game.dim] @ encounter.collision.normals.T
    low = below - means if mover == encounter.agents[0] else means - above
    units = _largest_units(game, index, mover, other.arrival, latest)[:count]
    clear = face_margins(low - encounter.collision.offsets, units)
    return bool((over_events(game, clear).max(axis=1) < game.margin_cap).any())


@lru_cache(maxsize=4096)
def _anywhere(
    game: Game, index: int, mover: int, latest: int, count: int
) -> tuple[np.ndarray, np.ndarray]:
    after = None if game.on_goal == "stay" else int(game.collisions == "swept")
    return _reach(game, game.encounters[index], mover).anywhere(latest, count, after)


@lru_cache(maxsize=4096)
def _largest_units(
    game: Game, index: int, mover: int, other: int | None, latest: int
) -> np.ndarray:
    """Return (H+1, F) the largest units over all arrivals of ``mover`` up to ``latest``."""
    encounter = game.encounters[index]
    times = [dict.fromkeys(encounter.agents, other) | {mover: t} for t in range(latest + 1)]
    cases = {rests(game, encounter, planned) for planned in times}
    return np.max([encounter_units(game, encounter, rest) for rest in sorted(cases)], axis=0)


def _reach(game: Game, encounter: Encounter, agent: int) -> Reach:
    normals = tuple(map(tuple, encounter.collision.normals.tolist()))
    return reach_of(game.agents[agent], normals, game.horizon)
