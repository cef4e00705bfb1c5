"""Arrays for the risk of crashes between bodies that follow plans.

Plans are made again at every step: of the errors of a displacement, those of one step count.

Sizes: E encounters, n state components, d position components, L steps of a plan.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ppg_env.env.arrays import Tables
from ppg_env.env.encounter_tables import encounter_kinds
from ppg_env.game.agent import Agent
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.risk.overlap import is_box
from solvers.feedback.replanning.errors_ahead import errors_ahead
from solvers.feedback.replanning.normal_tail import normal_table

LATER = 0.5
"""Share of the variance of a displacement that counts after the first step: a later near miss is
evaded when it comes."""


class Meetings(NamedTuple):
    """Encounters, and what a crash costs.

    dim d; pair, normals, offsets, path, obstacle_times, swept, stay, crash_cost: as in
    :class:`ppg_env.env.arrays.Tables`;
    deviations (L + 1, faces) of displacements along the faces;
    opposite (faces,): the parallel face on the other side, -1 without one; box (E,) whether the
    collision set is a box along the axes;
    tail: see :func:`solvers.feedback.replanning.normal_tail.normal_table`.
    """

    dim: int
    pair: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    path: np.ndarray
    obstacle_times: np.ndarray
    swept: bool
    stay: bool
    crash_cost: float
    deviations: np.ndarray
    opposite: np.ndarray
    box: np.ndarray
    tail: np.ndarray


def make_meetings(game: Game, tables: Tables) -> Meetings:
    """Return the arrays about encounters."""
    samples = encounter_kinds(game)[1]
    deviations = [np.zeros((game.horizon + 1, 0)), *(_deviations(game, e) for e in samples)]
    return Meetings(
        **{key: getattr(tables, key) for key in Meetings._fields[1:9]},
        dim=game.dim,
        deviations=np.concatenate(deviations, axis=1),
        opposite=_opposite(tables),
        box=np.array([is_box(e.collision.normals) for e in game.encounters], dtype=np.bool_),
        tail=normal_table(),
    )


def _position_errors(agent: Agent, horizon: int) -> np.ndarray:
    """Return (L + 1, d, d) covariances of positions; each step answers to what it observes.

    They stop growing once noise has reached the positions.
    """
    n, d = agent.state_dim, agent.dim
    early = errors_ahead(agent, np.arange(n + 1))[:, :d, :d]
    noisy = np.flatnonzero(np.trace(early, axis1=1, axis2=2) > 0)
    first = noisy[0] if noisy.size else 1
    times = np.arange(horizon + 1)
    share = np.where(times <= first, 1.0, LATER)
    return share[:, None, None] * early[np.minimum(times, first)]


def _deviations(game: Game, encounter: Encounter) -> np.ndarray:
    """Return (L + 1, F) deviations of a displacement along the faces."""
    normals = encounter.collision.normals
    total = np.zeros((game.horizon + 1, game.dim, game.dim))
    for i in encounter.agents:
        total += _position_errors(game.agents[i], game.horizon)
    if encounter.obstacle is not None:
        times = np.arange(game.horizon + 1)
        drift = np.where(times <= 1, times, LATER)
        total += drift[:, None, None] * game.obstacles[encounter.obstacle].noise
    return np.sqrt(np.einsum("fi,tij,fj->tf", normals, total, normals).clip(0.0))


def _opposite(tables: Tables) -> np.ndarray:
    """Return (faces,) the face of the same encounter with the opposite normal."""
    result = np.full(len(tables.normals), -1, dtype=np.int64)
    for first, last in {(first, last) for _, _, first, last in tables.pair.tolist()}:
        normals = tables.normals[first:last]
        facing = normals @ normals.T < -1 + 1e-12
        rows = np.flatnonzero(facing.any(axis=1))
        result[first + rows] = first + facing[rows].argmax(axis=1)
    return result
