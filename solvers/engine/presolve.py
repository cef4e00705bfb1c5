r"""Presolve: decide from the reachable sets what they determine, once arrivals are fixed.

A presolved encounter keeps the times at which its margin depends on the plans, and the faces that
can be reached there; at all other times the margin is at its cap, or fixed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game import objective
from ppg_env.game.game import Encounter, Game
from ppg_env.game.margins import encounter_units, end_of_traffic, margins
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
    times : (K,) undecided times.
    faces : (K, F) whether a face can be reached.
    high : (K, F) upper bounds of the clearance a_p'(r_i - r_j) - b_p.
    cap : (K,) largest margin within reach.
    fixed_loss : loss at all other times in traffic, which no plan changes.
    least : lower bound on the loss at ``times``.
    """

    index: int
    times: np.ndarray
    faces: np.ndarray
    high: np.ndarray
    cap: np.ndarray
    fixed_loss: float
    least: float


def presolve_encounters(
    subproblem: Subproblem, encounters: Iterable[int], arrivals: Mapping[int, int]
) -> list[PresolvedEncounter] | None:
    """Return :func:`presolve_encounter` of several encounters; None if one is infeasible."""
    results = [
        presolve_encounter(subproblem.game, e, arrivals, subproblem.given) for e in encounters
    ]
    feasible = [result for result in results if result is not None]
    return feasible if len(feasible) == len(results) else None


def presolve_encounter(
    game: Game, index: int, arrivals: Mapping[int, int], given: Mapping[int, Plan]
) -> PresolvedEncounter | None:
    """Presolve encounter ``index`` for movers that arrive at ``arrivals``; others are ``given``.

    The result is None if the reachable sets exclude that the bodies keep apart.
    """
    encounter = game.encounters[index]
    planned = {i: arrivals[i] if i in arrivals else given[i].arrival for i in encounter.agents}
    until = end_of_traffic(game, encounter, planned)
    low = high = np.zeros((until, len(encounter.collision.offsets)))
    for i, sign in zip(encounter.agents, (1.0, -1.0), strict=False):
        if i in arrivals:
            below, above = _reach(game, encounter, i).bounds(arrivals[i])
        else:
            below = above = given[i].means[:, : game.dim] @ encounter.collision.normals.T
        near, far = sign * below[:until], sign * above[:until]
        low, high = low + np.minimum(near, far), high + np.maximum(near, far)
    low, high = low - encounter.collision.offsets, high - encounter.collision.offsets
    units = encounter_units(game, encounter)[:until]
    cap = game.margin_cap
    faces = high >= -tol.LENGTH
    if not faces.any(axis=1).all():
        return None
    ceiling = margins(high, units, cap)
    floor = margins(low, units, cap)
    fixed = (high - low).max(axis=1, initial=0.0) <= tol.LENGTH / 10
    undecided = (floor < cap) & ~fixed
    fixed_loss = np.where(floor >= cap, cap, np.maximum(ceiling, 0.0))[~undecided]
    chosen = np.flatnonzero(undecided)
    return PresolvedEncounter(
        index,
        chosen,
        faces[chosen],
        high[chosen],
        np.maximum(ceiling[chosen], 0.0),
        float(objective.loss(game, fixed_loss).sum()),
        float(objective.loss(game, np.maximum(ceiling[chosen], 0.0)).sum()),
    )


def matters(game: Game, index: int, mover: int, other: Plan, latest: int) -> bool:
    """Return whether a plan of ``mover`` that arrives by ``latest`` can come near ``other``.

    If not, the margin of their encounter is at its cap for every plan of the mover.
    """
    encounter = game.encounters[index]
    planned = dict.fromkeys(encounter.agents, other.arrival) | {mover: latest}
    until = end_of_traffic(game, encounter, planned)
    if until <= 0:
        return False
    below, above = _anywhere(game, index, mover, latest)
    means = other.means[:until, : game.dim] @ encounter.collision.normals.T
    low = below[:until] - means if mover == encounter.agents[0] else means - above[:until]
    floor = margins(
        low - encounter.collision.offsets, encounter_units(game, encounter)[:until], game.margin_cap
    )
    return bool((floor < game.margin_cap).any())


@lru_cache(maxsize=4096)
def _anywhere(game: Game, index: int, mover: int, latest: int) -> tuple[np.ndarray, np.ndarray]:
    return _reach(game, game.encounters[index], mover).anywhere(latest)


def _reach(game: Game, encounter: Encounter, agent: int) -> Reach:
    normals = tuple(map(tuple, encounter.collision.normals.tolist()))
    return reach_of(game.agents[agent], normals, game.horizon)
