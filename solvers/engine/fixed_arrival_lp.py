r"""The linear program for fixed arrivals of the movers, whose faces are added as rows.

    minimise    sum_e omega_e sum_t l_et  +  sum_i eta_i sum_t |u_it|_1
    subject to  r_i0 = start,  r_i,t+1 = A r_it + B u_it,  u_it in U_it,  r_i,T_i = goal
                a' r_it <= limit_t                            for the faces a of its workspace
                a_p' (r_it - r_jt) - b_p >= unit_etp s_et     for the chosen face p of (e, t)
                l_et >= c(q) + c'(q) (s_et - q)               for tangent points q
                0 <= s_et <= cap_et

where e runs over encounters with a mover and t over the events at which it is in traffic.  If the
events are steps, a chosen face holds at both ends.  Where no face is chosen, the margin is free up
to its cap, so the program is a relaxation.  Events and faces that the reachable sets decide are
left out (:mod:`solvers.engine.presolve`); cap_et is the largest margin within reach.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game import objective
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.input_sets import set_at
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import workspace_limits, workspace_rows
from solvers.engine.disjunction import Clearance, Disjunction, Face
from solvers.engine.face_clearances import FaceClearances
from solvers.engine.presolve import PresolvedEncounter, Subproblem

FIRST_TANGENTS = 6
"""Tangents of each loss at the start; more are added at the margins of solutions."""


class FixedProgram:
    """The program of the module's docstring for movers that arrive at ``arrivals``.

    ``presolved`` are the presolved encounters, all of them or a part.

    Attributes
    ----------
    controls, means : (T_i, m) and (T_i + 1, n) columns of each mover's controls and means.
    disjunctions : the undecided times of the encounters.
    fixed_loss : weighted loss of each presolved encounter that no plan changes.
    """

    def __init__(
        self,
        subproblem: Subproblem,
        arrivals: Mapping[int, int],
        presolved: Sequence[PresolvedEncounter],
    ) -> None:
        self.subproblem, self.game, self.given = subproblem, subproblem.game, subproblem.given
        self.arrivals = dict(arrivals)
        self.fixed_loss: dict[int, float] = {}
        self._low: list[float] = []
        self._high: list[float] = []
        self._cost: list[float] = []
        self._rows: list[tuple[list[int], list[float], float, float]] = []
        self.means: dict[int, np.ndarray] = {}
        self._face_rows: dict[tuple[int, int], list[tuple[float, np.ndarray, np.ndarray]]] = {}
        self.controls: dict[int, np.ndarray] = {}
        self.disjunctions: list[Disjunction] = []
        for i, end in self.arrivals.items():
            self._add_mover(i, end)
        for encounter in presolved:  # those of weight zero too: bodies must not overlap
            weight = float(subproblem.objective.encounter[encounter.index])
            self.fixed_loss[encounter.index] = weight * encounter.fixed_loss
            self._add_encounter(encounter, weight)

    def _columns(self, shape: Any, low: Any = -inf, high: Any = inf, cost: float = 0.0) -> Any:
        """Add columns with their bounds and cost, and return their indices."""
        count, first = int(np.prod(shape)), len(self._low)
        for values, value in ((self._low, low), (self._high, high), (self._cost, cost)):
            scalar = isinstance(value, float)
            values += [value] * count if scalar else np.broadcast_to(value, shape).ravel().tolist()
        return np.arange(first, first + count).reshape(shape)

    def _fix(self, columns: np.ndarray, values: np.ndarray) -> None:
        for column, value in zip(columns.tolist(), values.tolist(), strict=True):
            self._low[column] = self._high[column] = value

    def _add_mover(self, i: int, end: int) -> None:
        """Add the controls and means of a mover that arrives at ``end``, and its dynamics."""
        agent = self.game.agents[i]
        n, m = agent.state_dim, agent.control_dim
        sets = planned_controls(agent, self.game.horizon)
        limits = np.array([set_at(sets, t).bounds for t in range(end)]).reshape(end, 2, m)
        u = self._columns((end, m), limits[:, 0], limits[:, 1])
        r = self._columns((end + 1, n))
        self.controls[i], self.means[i] = u, r
        self._fix(r[0], agent.start)
        self._fix(r[end, : agent.goal.size], agent.goal)
        for t in range(end):
            for k in range(n):
                columns = [r[t + 1, k], *r[t], *u[t]]
                self._row(columns, [1.0, *-agent.A[k], *-agent.B[k]], 0.0, 0.0)
            control = set_at(sets, t)
            if control.kind != "box":
                for normal, offset in zip(*control.faces, strict=True):
                    self._row(u[t], normal, -inf, float(offset))

        self._add_workspace(agent, r)
        weight = float(self.subproblem.objective.effort[i])
        if weight > 0 and end:
            self.add_sizes(u, weight)

    def _add_workspace(self, agent: Agent, r: np.ndarray) -> None:
        """Keep the means ``r`` (T+1, n) of an agent in its workspace."""
        rows, limits = workspace_rows(agent), workspace_limits(agent, self.game.horizon)
        for t, columns in enumerate(r):
            for row, limit in zip(rows, limits[t].tolist(), strict=True):
                self._row(columns, row, -inf, limit)

    def add_sizes(self, controls: np.ndarray, weight: float = 0.0) -> np.ndarray:
        """Add and return columns, of cost ``weight``, for the absolute values of ``controls``."""
        return self._absolute(controls, [(controls, 1.0)], weight)

    def add_differences(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Add and return columns for the absolute differences of two rows of columns."""
        return self._absolute(one, [(one, 1.0), (other, -1.0)], 0.0)

    def _absolute(
        self, like: np.ndarray, terms: list[tuple[np.ndarray, float]], weight: float
    ) -> np.ndarray:
        """Add columns that are at least the absolute values of a sum of ``terms``."""
        sizes = self._columns(like.shape, 0.0, inf, weight)
        for k, size in enumerate(sizes.ravel().tolist()):
            columns = [size, *(int(part.ravel()[k]) for part, _ in terms)]
            for sign in (1.0, -1.0):
                self._row(columns, [1.0, *(sign * factor for _, factor in terms)], 0.0, inf)
        return np.asarray(sizes)

    def require_face(self, k: int, p: int) -> None:
        """Add the rows of face ``p`` of disjunction ``k``."""
        for limit, columns, values in self.face_rows(k, p):
            self._row(columns, values, limit, inf)

    def raise_floor(self, column: int, least: float) -> None:
        """Require that a column is at least ``least``, which is at most its upper bound."""
        self._low[column] = max(self._low[column], least)

    def limit(self, columns: Any, values: Any, most: float) -> None:
        """Require that values . x[columns] is at most ``most``."""
        self._row(columns, values, -inf, most)

    def _row(self, columns: Any, values: Any, low: float, high: float) -> None:
        """Add low <= values . x[columns] <= high."""
        pairs = [(int(c), float(v)) for c, v in zip(columns, values, strict=True) if v]
        self._rows.append(([c for c, _ in pairs], [v for _, v in pairs], low, high))

    def _add_encounter(self, encounter: PresolvedEncounter, weight: float) -> None:
        """Add a disjunction for each undecided event of an encounter."""
        index, clearances = (
            encounter.index,
            FaceClearances(self.game, encounter, self.means, self.given),
        )
        least = objective.loss(self.game, encounter.most)
        for k, t in enumerate(encounter.times.tolist()):
            cap = float(encounter.cap[k])
            margin, loss = self._loss(cap, weight)
            faces = tuple(
                Face(p, clearances.of(t, p), float(least[k, p]))
                for p in np.flatnonzero(encounter.faces[k]).tolist()
            )
            lowest = self._low[loss]
            self.disjunctions.append(
                Disjunction(index, t, margin, loss, cap, lowest, weight, faces)
            )

    def _loss(self, cap: float, weight: float) -> tuple[int | None, int]:
        """Return the columns of a margin up to ``cap`` and of its loss.

        Where the loss is M' - s, its column determines s, and there is none for the margin.
        """
        if self.game.objective == "margin":
            most = self.game.margin_cap
            return None, int(self._columns(1, most - cap, most, cost=weight)[0])
        lowest = float(objective.loss(self.game, np.array(cap)))
        (margin,), (loss,) = self._columns(1, 0.0, cap), self._columns(1, lowest, cost=weight)
        # Curvature is largest near 0.7, so points thin out towards the cap.
        for point in cap * np.linspace(0, 1, FIRST_TANGENTS, endpoint=False) ** 1.4:
            if line := tangent(self.game, float(point)):
                self._row([loss, margin], [1.0, -line[0]], line[1], inf)
        return int(margin), int(loss)

    def face_key(self, disjunction: int, face: int) -> tuple[int, int, int]:
        """Return the encounter, the time and the index in the collision set of a face."""
        chosen = self.disjunctions[disjunction]
        return chosen.encounter, chosen.time, chosen.faces[face].index

    def point_at(self, means: Sequence[np.ndarray]) -> np.ndarray:
        """Return a point with these ``means`` of all agents and zeros elsewhere."""
        point = np.zeros(len(self._low))
        for i, columns in self.means.items():
            point[columns] = means[i][: len(columns)]
        return point

    def controls_at(self, point: np.ndarray) -> dict[int, np.ndarray]:
        """Return each mover's controls (H, m) at a solution of the program."""
        result = {}
        for i, columns in self.controls.items():
            result[i] = np.zeros((self.game.horizon, self.game.agents[i].control_dim))
            result[i][: self.arrivals[i]] = point[columns]
        return result

    def face_rows(self, k: int, p: int) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """Return lower limit, columns and values of the rows of face ``p`` of disjunction ``k``."""
        if (k, p) not in self._face_rows:
            disjunction = self.disjunctions[k]
            self._face_rows[k, p] = [
                self._face_row(disjunction, clearance)
                for clearance in disjunction.faces[p].clearances
            ]
        return self._face_rows[k, p]

    def _face_row(
        self, disjunction: Disjunction, clear: Clearance
    ) -> tuple[float, np.ndarray, np.ndarray]:
        if disjunction.margin is None:  # s = M' - loss
            limit = clear.unit * self.game.margin_cap - clear.constant
            column, value = disjunction.loss, clear.unit
        else:
            limit, column, value = -clear.constant, disjunction.margin, -clear.unit
        columns = np.append(clear.columns, column).astype(np.int32)
        return limit, columns, np.append(clear.values, value)

    def highs_model(self) -> Any:
        """Return the program as HiGHS takes it, without faces."""
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
    """Return slope and intercept of the loss's tangent at a margin; None if it is too flat."""
    at = np.array(point)
    slope = float(objective.loss_slope(game, at))
    if abs(slope) < tol.FLAT_SLOPE:
        return None
    return slope, float(objective.loss(game, at)) - slope * point
