"""Encounters as arrays: who meets whom, the faces and units of margin, and the sizes of bodies.

Encounters of equal bodies with equal covariances are of one kind and share their faces and units,
so that the arrays grow with the kinds, not with the pairs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.observation import moving_obstacles
from ppg_env.game.dynamics import covariances
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.margins import collision_faces, encounter_pairs, encounter_units
from ppg_env.game.polytope import Polytope

MANY_BODIES = 24
"""Bodies from which sorting finds the pairs that can meet faster than a loop over all pairs."""


def encounter_tables(game: Game, margin_reward: bool) -> dict[str, Any]:
    """Return the fields of :class:`ppg_env.env.arrays.Tables` about collisions and margins.

    Units are empty unless the reward counts margins.
    """
    kinds, samples = encounter_kinds(game)
    faces, pair = collision_faces(game, samples), encounter_pairs(game)
    moving = {k: len(game.agents) + b for b, k in enumerate(moving_obstacles(game))}
    bodies = len(game.agents) + len(game.obstacles)
    for e, encounter in enumerate(game.encounters):
        if encounter.obstacle is not None:
            pair[e, 1] = moving.get(encounter.obstacle, -1)
    return {
        "pair": np.column_stack([pair, faces.first[kinds], faces.first[kinds + 1]]),
        "own_faces": 0,
        "normals": faces.normals,
        "offsets": faces.offsets,
        "depths": faces.depths,
        "units": margin_units(game) if margin_reward else np.zeros((3, game.horizon + 1, 0)),
        "extents": extents(game),
        "sorting": bodies >= MANY_BODIES,
        "margin_cap": game.margin_cap,
        "crash_cost": game.crash_cost,
    }


def encounter_kinds(game: Game) -> tuple[np.ndarray, list[Encounter]]:
    """Return (E,) the kind of each encounter, and the first encounter of each kind."""
    spread = [covariances(agent, game.horizon) for agent in game.agents]
    spread += [obstacle.covariances(game.horizon) for obstacle in game.obstacles]
    first_body: dict[tuple[Polytope, bytes], int] = {}
    keys = [(shape, spread[b].tobytes()) for b, shape in enumerate(_shapes(game))]
    bodies = [first_body.setdefault(key, b) for b, key in enumerate(keys)]
    N, samples = len(game.agents), list[Encounter]()
    numbers: dict[tuple[int, int], int] = {}
    kinds = np.empty(len(game.encounters), dtype=np.int64)
    for e, encounter in enumerate(game.encounters):
        i, k = encounter.agents[0], encounter.obstacle
        key = bodies[i], bodies[encounter.agents[1] if k is None else N + k]
        if key not in numbers:
            numbers[key] = len(samples)
            samples.append(encounter)
        kinds[e] = numbers[key]
    return kinds, samples


def margin_units(game: Game) -> np.ndarray:
    """Return (3, H+1, faces) units of margin of all kinds of encounters.

    The second and third part are the squares of the units due to either body alone.
    """
    samples = encounter_kinds(game)[1]
    return np.concatenate(
        [np.zeros((3, game.horizon + 1, 0)), *(_units(game, sample) for sample in samples)], axis=2
    )


def _units(game: Game, encounter: Encounter) -> np.ndarray:
    """Return (3, H+1, F) units of margin, and the squares of those due to either body alone."""
    spread = [
        covariances(game.agents[i], game.horizon)[:, : game.dim, : game.dim]
        for i in encounter.agents
    ]
    if encounter.obstacle is not None:
        spread.append(game.obstacles[encounter.obstacle].covariances(game.horizon))
    normals, scale = encounter.collision.normals, 2.0 if game.scale == "exact" else 1.0
    result = np.zeros((3, game.horizon + 1, len(normals)))
    result[0] = encounter_units(game, encounter)
    for k, covariance in enumerate(spread):
        along = np.einsum("fi,tij,fj->tf", normals, covariance, normals)
        result[1 + k] = scale * np.maximum(along, 0.0)
    return result


def _shapes(game: Game) -> list[Polytope]:
    return [*(a.shape for a in game.agents), *(o.shape for o in game.obstacles)]


def extents(game: Game) -> np.ndarray:
    """Return (2, N + O, d) lowest and highest points of all bodies, about their reference points.

    Obstacles follow in the order of the game.  Two bodies overlap only if the boxes do: these are
    wider than the bodies by the tolerance of touching, for rounding.
    """
    bounds = [shape.bounds for shape in _shapes(game)]
    wider = tol.LENGTH * game.unit
    return np.array([[low - wider, high + wider] for low, high in bounds]).swapaxes(0, 1).copy()
