"""Clearances of faces as linear functions of the means in a program for fixed arrivals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.margins import encounter_units
from ppg_env.game.plan import Plan
from solvers.engine.disjunction import Clearance
from solvers.engine.presolve import PresolvedEncounter


class FaceClearances:
    """Clearances of the faces of one encounter in terms of the columns of a program.

    ``means`` (T_i + 1, n) are the columns of each mover's means; other agents are ``given``.
    """

    def __init__(
        self,
        game: Game,
        presolved: PresolvedEncounter,
        means: Mapping[int, np.ndarray],
        given: Mapping[int, Plan],
    ) -> None:
        encounter, d = game.encounters[presolved.index], game.dim
        self._ends = (0,) if game.collisions == "instants" else (0, 1)
        self._units = encounter_units(game, encounter, presolved.rest)
        self._normals, self._offsets = encounter.collision.faces
        self._obstacle = None if encounter.obstacle is None else game.obstacle_positions(encounter)
        pairs = list(zip(encounter.agents, (1.0, -1.0), strict=False))
        self._movers = [(means[i][:, :d], sign) for i, sign in pairs if i in means]
        self._given = [(given[i].means[:, :d], sign) for i, sign in pairs if i not in means]
        self._columns: dict[int, np.ndarray] = {}
        self._values: dict[int, np.ndarray] = {}

    def of(self, event: int, p: int) -> tuple[Clearance, ...]:
        """Return the clearances of face ``p`` at the instants of an event."""
        if p not in self._values:
            values = [sign * self._normals[p] for _, sign in self._movers]
            self._values[p] = np.concatenate(values)
        return tuple(self._at(event + end, p) for end in self._ends)

    def _at(self, t: int, p: int) -> Clearance:
        """Return the clearance of face ``p`` at instant ``t``."""
        if t not in self._columns:
            rows = [columns[min(t, len(columns) - 1)] for columns, _ in self._movers]
            self._columns[t] = np.concatenate(rows)
        normal, constant = self._normals[p], -float(self._offsets[p])
        if self._obstacle is not None:
            constant -= float(normal @ self._obstacle[t])
        for means, sign in self._given:
            constant += sign * float(normal @ means[t])
        unit = float(self._units[t, p])
        return Clearance(self._columns[t], self._values[p], constant, unit)
