"""Margins of encounters, and who is in an encounter until when."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.dynamics import covariances
from ppg_env.game.game import Encounter, Game
from ppg_env.game.plan import Profile


def encounter_covariances(game: Game, encounter: Encounter) -> np.ndarray:
    """(H+1, d, d) covariances of the displacement, Sigma_i + Sigma_j."""
    positions = np.s_[:, : game.dim, : game.dim]
    total = np.zeros((game.horizon + 1, game.dim, game.dim))
    for i in encounter.agents:
        total += covariances(game.agents[i], game.horizon)[positions]
    return total


def encounter_deviations(game: Game, encounter: Encounter) -> np.ndarray:
    """(H+1, F) sigma_p(t), the deviation of the displacement along each face of K."""
    normals, total = encounter.collision.normals, encounter_covariances(game, encounter)
    return np.sqrt(np.maximum(np.einsum("fi,tij,fj->tf", normals, total, normals), 0.0))


@lru_cache(maxsize=8192)
def encounter_units(game: Game, encounter: Encounter) -> np.ndarray:
    """(H+1, F) length of one unit of margin: sqrt(2) sigma_p(t), or sigma_p(t) on paper scale.

    Read-only: no plan changes it.
    """
    unit = encounter_deviations(game, encounter) * (np.sqrt(2) if game.scale == "exact" else 1.0)
    unit = np.where(unit > tol.DEVIATION, unit, 0.0)
    unit.setflags(write=False)
    return unit


def profile_margins(game: Game, profile: Profile) -> np.ndarray:
    """(E, H+1) margins min(M', s) along the means, whether in traffic or not."""
    means = np.array([plan.means[:, : game.dim] for plan in profile])
    result = np.empty((len(game.encounters), game.horizon + 1))
    for row, encounter in zip(result, game.encounters, strict=True):
        where = encounter.displacement(*(means[i] for i in encounter.agents))
        row[:] = margins(
            where @ encounter.collision.normals.T - encounter.collision.offsets,
            encounter_units(game, encounter),
            game.margin_cap,
        )
    return result


def margins(clearances: np.ndarray, units: np.ndarray, cap: float) -> np.ndarray:
    """(...,) min(cap, best face) of ``clearances`` (..., F) measured in ``units`` (..., F).

    A face without noise is worth the cap when it is clear, and minus infinity when it is not.
    """
    certain = np.where(clearances >= -tol.LENGTH, np.inf, -np.inf)
    scaled = np.divide(clearances, units, out=certain, where=units > 0)
    return np.minimum(scaled.max(axis=-1), cap)


def in_traffic(game: Game, arrival: tuple[int | None, ...]) -> np.ndarray:
    """Return (E, H+1) whether each encounter is in traffic: t < T_i for all of its agents."""
    times = np.arange(game.horizon + 1)
    last = np.array([game.horizon + 1 if t is None else t for t in arrival])
    until = np.array([min(last[i] for i in e.agents) for e in game.encounters])
    return times[None, :] < until.reshape(-1, 1)


def membership(game: Game) -> np.ndarray:
    """Return (N, E) ones where an agent takes part in an encounter, zeros elsewhere."""
    agents = range(len(game.agents))
    return np.array([[float(i in e.agents) for e in game.encounters] for i in agents]).reshape(
        len(game.agents), len(game.encounters)
    )
