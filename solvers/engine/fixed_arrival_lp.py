r"""One program with the movers' arrivals fixed, as a linear program whose faces are switched on.

    minimise    sum_e omega_e sum_t l_et
    subject to  r_i0 = start,  r_i,t+1 = A r_it + B u_it,  u_it in U_it,  r_i,T_i = goal
                a_p' (r_it - r_jt) - b_p >= unit_etp s_et     for the chosen face p of (e, t)
                l_et >= c(q) + c'(q) (s_et - q)               for tangent points q
                0 <= s_et <= cap_et

e runs over encounters with a mover, t over the times at which it is in traffic.  Where no face is
chosen, nothing holds the margin below its cap: the program is a relaxation, and a bound.  What
the reachable sets decide is left out: times at which the margin is at its cap whatever anybody
does, and faces that cannot be reached; cap_et is the largest margin within reach.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppg_env.game import objective
from ppg_env.game.game import Game
from ppg_env.game.margins import encounter_units
from ppg_env.game.plan import Profile, make_plan
from solvers.engine.presolve import PresolvedEncounter, Subproblem

FIRST_TANGENTS = 6
"""Tangents of each loss to begin with; more come where answers sit."""

FLATTEST = 1e-8
"""Slopes below this are dropped, as HiGHS would drop them."""

INF = float("inf")


@dataclass(frozen=True)
class Face:
    """A face of a disjunction, ``index`` p of its collision set.

    Its clearance is values . x[columns] + constant, in ``unit`` per margin; ``least`` is the
    smallest loss that it allows.
    """

    index: int
    columns: np.ndarray
    values: np.ndarray
    constant: float
    unit: float
    least: float


@dataclass(frozen=True)
class Disjunction:
    """One encounter at one time that is left open: columns of its margin, if any, and its loss."""

    encounter: int
    time: int
    margin: int | None
    loss: int
    cap: float
    lowest: float
    weight: float
    faces: tuple[Face, ...]


class FixedProgram:
    """The program of the module's page for movers that arrive at ``arrivals``.

    ``presolve_encounters`` holds what :func:`~solvers.engine.presolve.presolve_encounter` left
    open, of all encounters or of a part of them.

    Attributes
    ----------
    controls : (T_i, m) columns of each mover's controls.
    disjunctions : what there is to choose.
    fixed_loss : weighted loss of each encounter of ``presolve_encounters`` that no plan changes.
    """

    def __init__(
        self,
        subproblem: Subproblem,
        arrivals: Mapping[int, int],
        presolve_encounters: Sequence[PresolvedEncounter],
    ) -> None:
        self.subproblem, self.game, self.given = subproblem, subproblem.game, subproblem.given
        self.arrivals = dict(arrivals)
        self.fixed_loss: dict[int, float] = {}
        self._low: list[float] = []
        self._high: list[float] = []
        self._cost: list[float] = []
        self._rows: list[tuple[list[int], list[float], float, float]] = []
        self._means: dict[int, np.ndarray] = {}
        self._made: dict[tuple[int, int], tuple[float, np.ndarray, np.ndarray]] = {}
        self.controls: dict[int, np.ndarray] = {}
        self.disjunctions: list[Disjunction] = []
        for i, end in self.arrivals.items():
            self._move(i, end)
        for one in (
            presolve_encounters
        ):  # also those that cost the movers nothing: bodies must not overlap
            weight = float(subproblem.objective.encounter[one.index])
            self.fixed_loss[one.index] = weight * one.fixed_loss
            self._meet(one, weight)

    def _columns(self, shape: Any, low: Any = -INF, high: Any = INF, cost: float = 0.0) -> Any:
        count, first = int(np.prod(shape)), len(self._low)
        self._low += np.broadcast_to(low, shape).ravel().tolist()
        self._high += np.broadcast_to(high, shape).ravel().tolist()
        self._cost += [cost] * count
        return np.arange(first, first + count).reshape(shape)

    def _fix(self, columns: np.ndarray, values: np.ndarray) -> None:
        for column, value in zip(columns.tolist(), values.tolist(), strict=True):
            self._low[column] = self._high[column] = value

    def _move(self, i: int, end: int) -> None:
        agent = self.game.agents[i]
        n, m = agent.state_dim, agent.control_dim
        limits = np.array([agent.control_at(t).bounds for t in range(end)]).reshape(end, 2, m)
        u = self._columns((end, m), limits[:, 0], limits[:, 1])
        r = self._columns((end + 1, n))
        self.controls[i], self._means[i] = u, r
        self._fix(r[0], agent.start)
        self._fix(r[end, : agent.goal.size], agent.goal)
        for t in range(end):
            for k in range(n):
                columns = [r[t + 1, k], *r[t], *u[t]]
                self._row(columns, [1.0, *-agent.A[k], *-agent.B[k]], 0.0, 0.0)
            control = agent.control_at(t)
            if control.kind != "box":
                for normal, offset in zip(*control.faces, strict=True):
                    self._row(u[t], normal, -INF, float(offset))

    def _row(self, columns: Any, values: Any, low: float, high: float) -> None:
        """Add low <= values . x[columns] <= high."""
        pairs = [(int(c), float(v)) for c, v in zip(columns, values, strict=True) if v]
        self._rows.append(([c for c, _ in pairs], [v for _, v in pairs], low, high))

    def _meet(self, one: PresolvedEncounter, weight: float) -> None:
        units = encounter_units(self.game, self.game.encounters[one.index])
        for k, t in enumerate(one.times.tolist()):
            cap = float(one.cap[k])
            margin, loss = self._loss(cap, weight)
            faces = tuple(
                self._face(one, k, p, float(units[t, p]))
                for p in np.flatnonzero(one.faces[k]).tolist()
            )
            lowest = self._low[loss]
            self.disjunctions.append(
                Disjunction(one.index, t, margin, loss, cap, lowest, weight, faces)
            )

    def _loss(self, cap: float, weight: float) -> tuple[int | None, int]:
        """Columns of a margin up to ``cap`` and of its loss.

        Where the loss is M' - s, its column is all that there is to know of s.
        """
        if self.game.objective == "margin":
            most = self.game.margin_cap
            return None, int(self._columns(1, most - cap, most, cost=weight)[0])
        lowest = float(objective.loss(self.game, np.array(cap)))
        (margin,), (loss,) = self._columns(1, 0.0, cap), self._columns(1, lowest, cost=weight)
        # Curvature is largest near 0.7: points thin out towards the cap.
        for point in cap * np.linspace(0, 1, FIRST_TANGENTS, endpoint=False) ** 1.4:
            if line := tangent(self.game, float(point)):
                self._row([loss, margin], [1.0, -line[0]], line[1], INF)
        return int(margin), int(loss)

    def _face(self, one: PresolvedEncounter, k: int, p: int, unit: float) -> Face:
        encounter, d = self.game.encounters[one.index], self.game.dim
        normal, t = encounter.collision.normals[p], int(one.times[k])
        columns, values, constant = [], [], -float(encounter.collision.offsets[p])
        for i, sign in zip(encounter.agents, (1.0, -1.0), strict=False):
            if i in self.arrivals:
                columns.append(self._means[i][t, :d])
                values.append(sign * normal)
            else:
                constant += sign * float(normal @ self.given[i].means[t, :d])
        place, along = np.concatenate(columns), np.concatenate(values)
        cap = float(one.cap[k])
        most = cap if unit == 0 else min(cap, max(float(one.high[k, p]) / unit, 0.0))
        least = float(objective.loss(self.game, np.array(most)))
        return Face(p, place, along, constant, unit, least)

    def named(self, disjunction: int, face: int) -> tuple[int, int, int]:
        """Encounter, time and index of a face, whatever is left out around it."""
        one = self.disjunctions[disjunction]
        return one.encounter, one.time, one.faces[face].index

    def point(self, means: Sequence[np.ndarray]) -> np.ndarray:
        """A point of the program with these ``means`` of all agents, and nothing else in it."""
        point = np.zeros(len(self._low))
        for i, columns in self._means.items():
            point[columns] = means[i][: len(columns)]
        return point

    def plans(self, point: np.ndarray) -> Profile:
        """Everybody's plans: the movers' from a solution of the program, the others' as given."""
        plans = []
        for i, agent in enumerate(self.game.agents):
            if i not in self.controls:
                plans.append(self.given[i])
                continue
            controls = np.zeros((self.game.horizon, agent.control_dim))
            controls[: self.arrivals[i]] = point[self.controls[i]]
            plans.append(make_plan(agent, controls))
        return tuple(plans)

    def row(self, disjunction: int, face: int) -> tuple[float, np.ndarray, np.ndarray]:
        """Lower limit, columns and values of the row that makes a face hold."""
        if (disjunction, face) not in self._made:
            self._made[disjunction, face] = self._face_row(disjunction, face)
        return self._made[disjunction, face]

    def _face_row(self, disjunction: int, face: int) -> tuple[float, np.ndarray, np.ndarray]:
        one = self.disjunctions[disjunction]
        chosen = one.faces[face]
        if one.margin is None:  # s = M' - loss
            limit = chosen.unit * self.game.margin_cap - chosen.constant
            column, value = one.loss, chosen.unit
        else:
            limit, column, value = -chosen.constant, one.margin, -chosen.unit
        columns = np.append(chosen.columns, column).astype(np.int32)
        return limit, columns, np.append(chosen.values, value)

    def model(self) -> Any:
        """The program as HiGHS takes it, without faces."""
        import highspy

        model = highspy.HighsLp()
        model.num_col_, model.num_row_ = len(self._low), len(self._rows)
        model.col_cost_ = np.array(self._cost)
        model.col_lower_, model.col_upper_ = np.array(self._low), np.array(self._high)
        model.row_lower_ = np.array([row[2] for row in self._rows])
        model.row_upper_ = np.array([row[3] for row in self._rows])
        model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        sizes = [len(row[0]) for row in self._rows]
        model.a_matrix_.start_ = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)
        model.a_matrix_.index_ = np.array([c for row in self._rows for c in row[0]], dtype=np.int32)
        model.a_matrix_.value_ = np.array([v for row in self._rows for v in row[1]])
        return model


def tangent(game: Game, point: float) -> tuple[float, float] | None:
    """Slope and intercept of the loss's tangent at a margin; None if it is too flat to count."""
    at = np.array(point)
    slope = float(objective.loss_slope(game, at))
    if abs(slope) < FLATTEST:
        return None
    return slope, float(objective.loss(game, at)) - slope * point
