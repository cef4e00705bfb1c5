"""Variables and constraints of one encounter (:mod:`solvers.reference.formulation`)."""

from __future__ import annotations

import cvxpy as cp
import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.margins import encounter_units
from ppg_env.game.objective import loss
from ppg_env.game.plan import Profile
from ppg_env.game.reachability import plan_upper
from solvers.reference.mover import Mover
from solvers.reference.tangents import TangentTable


class Separation:
    """Variables and constraints of one encounter with at least one mover.

    ``offsets``, ``active`` and ``big`` are parameters where the other side's plan is given.
    """

    def __init__(self, game: Game, encounter: Encounter, movers: dict[int, Mover]) -> None:
        self.game, self.encounter = game, encounter
        self.moving = [i for i in encounter.agents if i in movers]
        self.given = [i for i in encounter.agents if i not in movers]
        self.signs = {i: 1.0 if i == encounter.agents[0] else -1.0 for i in encounter.agents}
        self.units = encounter_units(game, encounter)
        shape = self.units.shape
        steps = shape[0]
        self.margin = cp.Variable(steps, bounds=[0, game.margin_cap])
        self.loss = cp.Variable(steps, nonneg=True)
        self.face = cp.Variable(shape, boolean=True)
        self.face_low = cp.Parameter(shape, value=np.zeros(shape))
        self.face_high = cp.Parameter(shape, value=np.ones(shape))
        self.offsets = cp.Parameter(shape)
        self.big = cp.Parameter(shape, nonneg=True)
        self.active = cp.Parameter(steps, nonneg=True)
        self.tangents = TangentTable(game, steps)
        self.constraints = self._constraints(movers)
        self.possible_faces = np.ones(shape)

    def _constraints(self, movers: dict[int, Mover]) -> list[cp.Constraint]:
        """Return the constraints on margins, faces and losses."""
        game, (steps, count) = self.game, self.units.shape
        clear = (
            sum(self.signs[i] * (movers[i].means @ self._rows(i).T) for i in self.moving)
            - self.offsets
        )
        out = sum(movers[i].arrived for i in self.moving) + (1 - self.active)  # of traffic
        worst = float(loss(game, np.array(game.margin_cap)))
        column = cp.reshape(self.margin, (steps, 1), order="C")
        spread = column @ np.ones((1, count))
        pieces = np.ones((1, self.tangents.count))
        return [
            clear >= cp.multiply(self.units, spread) - cp.multiply(self.big, 1 - self.face),
            cp.sum(self.face, axis=1) >= 1 - out,
            self.face >= self.face_low,
            self.face <= self.face_high,
            cp.reshape(self.loss + worst * out, (steps, 1), order="C") @ pieces
            >= cp.multiply(self.tangents.slopes, column @ pieces) + self.tangents.intercepts,
        ]

    def _rows(self, agent: int) -> np.ndarray:
        """(F, n) face normals in the state space of ``agent``."""
        normals, n = self.encounter.collision.normals, self.game.agents[agent].state_dim
        return np.hstack([normals, np.zeros((len(normals), n - normals.shape[1]))])

    def update(self, profile: Profile | None) -> None:
        """Set the parameters: the given side's plan, and the faces within reach against it."""
        steps = self.game.horizon + 1
        offsets = np.tile(self.encounter.collision.offsets, (steps, 1))
        active = np.ones(steps)
        for i in self.given:
            assert profile is not None
            offsets = offsets - self.signs[i] * (profile[i].means @ self._rows(i).T)
            last = profile[i].arrival
            active *= np.arange(steps) < (steps if last is None else last)
        highest, lowest = -offsets, -offsets
        for i in self.moving:
            agent, rows = self.game.agents[i], self.signs[i] * self._rows(i)
            highest = highest + plan_upper(agent, rows, self.game.horizon)
            lowest = lowest - plan_upper(agent, -rows, self.game.horizon)
        cap = self.game.margin_cap
        self.offsets.value = offsets
        self.active.value = active
        self.big.value = np.maximum(self.units * cap - lowest, 0.0)
        # A face that can just be touched is possible; rounding must not exclude it.
        self.possible_faces = (highest >= -tol.LENGTH).astype(float)
        self.release()

    def release(self) -> None:
        """Free the choice of faces."""
        self.face_low.value = np.zeros(self.units.shape)
        self.face_high.value = self.possible_faces

    def fix(self, choice: np.ndarray) -> None:
        """Fix the faces (H+1, F) to ``choice``."""
        self.face_low.value = choice
        self.face_high.value = choice
