"""Variables and constraints of one encounter (:mod:`solvers.reference.formulation`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import cvxpy as cp
import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.margins import encounter_units, end_of_traffic, over_events, rests
from ppg_env.game.objective import loss
from ppg_env.game.plan import Profile
from solvers.reference.mover import Mover, spread
from solvers.reference.tangents import TangentTable


class ClearanceRows:
    """Rows a_p' (y_i - y_j)(t) - b_p >= unit_tp s - M (2 - z_p - w) at the instants of events.

    Attributes
    ----------
    events, instants : (K,) the events, and the instants t at one of their ends.
    parked : the mover and the arrival for which the rows hold; empty for those that hold otherwise.
    when : w, 1 where the rows hold and at most 0 elsewhere.
    units, big : (K, F) parameters.
    """

    def __init__(
        self, events: np.ndarray, end: int, count: int, parked: dict[int, int], when: cp.Expression
    ) -> None:
        self.events, self.instants, self.parked, self.when = events, events + end, parked, when
        self.offsets = cp.Parameter((len(events), count))
        self.units = cp.Parameter((len(events), count), nonneg=True)
        self.big = cp.Parameter((len(events), count), nonneg=True)

    def constraint(
        self, apart: cp.Expression, margin: cp.Expression, face: cp.Expression
    ) -> cp.Constraint:
        """Return the rows for the movers' a_p' y (H+1, F) and the margins and faces of events."""
        columns = spread(margin[self.events], face.shape[1])
        missing = 2 - face[self.events] - self.when
        wanted = cp.multiply(self.units, columns) - cp.multiply(self.big, missing)
        return apart[self.instants] - self.offsets >= wanted

    def update(
        self, offsets: np.ndarray, units: np.ndarray, lowest: np.ndarray, cap: float
    ) -> None:
        """Set the parameters from arrays (H+1, F); clearances are at least ``lowest``."""
        t = self.instants
        self.offsets.value, self.units.value = offsets[t], units[t]
        self.big.value = np.maximum(units[t] * cap - lowest[t], 0.0)


class Separation:
    """Variables and constraints of one encounter with at least one mover.

    What depends on the other side is a parameter where its plan is given.

    Attributes
    ----------
    margin, loss : (K,) variables s and l of the events, K = H+1 instants or H steps.
    face : (K, F) binary variables z.
    ended, settled : (K,) parameters, 1 where the event is out of traffic whatever the movers do,
        and where it is once they have arrived.
    """

    def __init__(self, game: Game, encounter: Encounter, movers: Mapping[int, Mover]) -> None:
        self.game, self.encounter = game, encounter
        self.movers = {i: movers[i] for i in encounter.agents if i in movers}
        self.given = [i for i in encounter.agents if i not in movers]
        self.signs = {i: 1.0 if i == encounter.agents[0] else -1.0 for i in encounter.agents}
        events = game.horizon + (game.collisions == "instants")
        shape = events, len(encounter.collision.offsets)
        self.margin = cp.Variable(events, bounds=[0, game.margin_cap])
        self.loss = cp.Variable(events, nonneg=True)
        self.face = cp.Variable(shape, boolean=True)
        self.face_low = cp.Parameter(shape, value=np.zeros(shape))
        self.face_high = cp.Parameter(shape, value=np.ones(shape))
        self.ended = cp.Parameter(events, nonneg=True)
        self.settled = cp.Parameter(events, nonneg=True)
        self.tangents = TangentTable(game, events)
        self.possible_faces = np.ones(shape)
        ends = (0,) if game.collisions == "instants" else (0, 1)
        self.rows = [rows for end in ends for rows in self._rows(end)]
        self.constraints = [*self._faces(), *self._traffic()]

    def _rows(self, end: int) -> Iterator[ClearanceRows]:
        """Yield the rows at one end of the events: first the general ones, then those of arrivals.

        Two movers never have both been parked before an instant that is in traffic.
        """
        events, count = self.face.shape
        at, otherwise, special = np.arange(events), cp.Constant(1.0), []
        for i, mover in self.movers.items():
            cases = self._special_arrivals(i)
            if cases:
                special += [(i, k) for k in cases]
                before = np.zeros((events, self.game.horizon + 1))
                before[:, cases] = at[:, None] + end > cases
                otherwise = otherwise - before @ mover.arrival
        yield ClearanceRows(at, end, count, {}, spread(otherwise, count) if special else otherwise)
        for i, k in special:
            later = at[at + end > k]
            if len(later):
                yield ClearanceRows(later, end, count, {i: k}, self.movers[i].arrival[k])

    def _special_arrivals(self, i: int) -> list[int]:
        """Return the arrivals of a mover that leave its errors other than if it did not park."""
        free = self._units({}, {})
        return [
            k
            for k in np.flatnonzero(self.movers[i].possible_arrivals).tolist()
            if np.abs(self._units({}, {i: k}) - free).max() > tol.DEVIATION
        ]

    def _units(self, given: Mapping[int, int | None], parked: Mapping[int, int]) -> np.ndarray:
        """Return (H+1, F) units for arrivals of the given agents and of a parked mover."""
        arrivals = dict.fromkeys(self.encounter.agents) | dict(given) | dict(parked)
        return encounter_units(
            self.game, self.encounter, rests(self.game, self.encounter, arrivals)
        )

    def _faces(self) -> list[cp.Constraint]:
        """Return the constraints that make chosen faces clear."""
        normals = self.encounter.collision.normals
        apart = sum(self.signs[i] * (mover.body @ normals.T) for i, mover in self.movers.items())
        clear = [rows.constraint(apart, self.margin, self.face) for rows in self.rows]
        return [*clear, self.face >= self.face_low, self.face <= self.face_high]

    def _traffic(self) -> list[cp.Constraint]:
        """Return the constraints on events in traffic: a face is chosen, and losses count."""
        events = self.loss.size
        arrived = [mover.arrived[:events] for mover in self.movers.values()]
        constraints: list[cp.Constraint] = []
        if self.game.on_goal == "stay":
            parked = cp.Variable(events, nonneg=True)
            constraints = [parked <= self.settled, *(parked <= each for each in arrived)]
            out = parked + self.ended
        else:
            out = sum(arrived) + self.ended
        worst, pieces = float(loss(self.game, np.array(self.game.margin_cap))), self.tangents.count
        tangents = (
            cp.multiply(self.tangents.slopes, spread(self.margin, pieces))
            + self.tangents.intercepts
        )
        return [
            *constraints,
            cp.sum(self.face, axis=1) >= 1 - out,
            spread(self.loss + worst * out, pieces) >= tangents,
        ]

    def update(self, profile: Profile | None) -> None:
        """Set the parameters: the given side's plan, and the faces within reach against it."""
        game, encounter = self.game, self.encounter
        normals, events = encounter.collision.normals, np.arange(self.loss.size)
        given: dict[int, int | None] = {}
        offsets = encounter.collision.offsets + game.obstacle_positions(encounter) @ normals.T
        for i in self.given:
            assert profile is not None
            given[i] = profile[i].arrival
            offsets = offsets - self.signs[i] * (profile[i].means[:, : game.dim] @ normals.T)
        for ends, arrival in ((self.ended, None), (self.settled, 0)):
            last = end_of_traffic(game, encounter, given | dict.fromkeys(self.movers, arrival))
            ends.value = 1.0 * (events >= last)
        highest, lowest = -offsets, -offsets
        for i, mover in self.movers.items():
            highest = highest + mover.reach(self.signs[i] * normals)
            lowest = lowest - mover.reach(-self.signs[i] * normals)
        for rows in self.rows:
            rows.update(offsets, self._units(given, rows.parked), lowest, game.margin_cap)
        # A face that can just be touched is possible; rounding must not exclude it.
        self.possible_faces = (over_events(game, highest) >= -tol.LENGTH).astype(float)
        self.release()

    def release(self) -> None:
        """Free the choice of faces."""
        self.face_low.value = np.zeros(self.face.shape)
        self.face_high.value = self.possible_faces

    def fix(self, choice: np.ndarray) -> None:
        """Fix the faces (K, F) to ``choice``."""
        self.face_low.value = choice
        self.face_high.value = choice
