r"""The linear program of a node: the program for fixed arrivals with the faces of the node.

The program is kept from node to node, so that the simplex method continues from the last basis.
Rows of three kinds are added:

    faces       a_p' (r_i - r_j) - b_p >= unit_p s      while the node has chosen face p, one row
                                                        per instant
    tangents    l >= c(q) + c'(q) (s - q)               at the margins of solutions, kept until
                                                        there are many
    cuts        sum_e omega_e sum_t l_et >= least       kept
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game import objective
from ppg_env.game.margins import face_margins
from solvers.budget import Budget
from solvers.engine.disjunction import Choice, Disjunction
from solvers.engine.fixed_arrival_lp import FixedProgram, tangent

CURVATURE = 1e-8
"""A tangent is added where the weighted loss exceeds the relaxed one by more than this."""

MOST_TANGENTS = 200
"""Tangents beyond which those that no longer bind are dropped.  Between 100 and 400 the search is
fastest."""

MOST_AT_INSTANTS = 1200
"""The same at instants without obstacles, where stored studies keep the paths of searches."""

TANGENT = (-1, -1)
"""Mark of the row of a tangent."""

REFINEMENTS = 30
"""Largest number of rounds of tangents in one node; two or three are usual."""


class Relaxation:
    """The linear program for fixed arrivals, solved repeatedly with different faces.

    Parameters
    ----------
    program : the program without faces.
    spent : time cost of the arrivals, added to every value.

    Attributes
    ----------
    faces : all faces of the program, to compute the margins of points.
    active : disjunctions of which a face holds.
    """

    def __init__(self, program: FixedProgram, spent: float, budget: Budget) -> None:
        import highspy

        self.program, self.faces = program, Faces(program.disjunctions)
        self._base, self._budget = spent + sum(program.fixed_loss.values()), budget
        self._optimal = highspy.HighsModelStatus.kOptimal
        self._infeasible = highspy.HighsModelStatus.kInfeasible
        self._lp = highspy.Highs()
        for name, value in OPTIONS.items():
            self._lp.setOptionValue(name, value)
        self._lp.passModel(program.highs_model())
        self._first, self._rows = self._lp.getNumRow(), list[tuple[int, int] | None]()
        stored = program.game.collisions == "instants" and not program.game.obstacles
        self._most_tangents = MOST_AT_INSTANTS if stored else MOST_TANGENTS
        self.active: list[int] = []

    def add_cut(self, encounters: Sequence[int], least: float) -> None:
        """Require that the weighted losses of ``encounters`` add up to at least ``least``."""
        undecided = [m for m in self.program.disjunctions if m.encounter in encounters]
        least = least - sum(self.program.fixed_loss.get(e, 0.0) for e in encounters)
        if undecided and least > tol.MIP_GAP:
            columns = np.array([m.loss for m in undecided], dtype=np.int32)
            self._add(None, least, columns, np.array([m.weight for m in undecided]))

    def set_faces(self, choice: Choice) -> None:
        """Replace the faces that hold by those of ``choice``."""
        keep = {None, TANGENT, *choice}
        self._delete([n for n, face in enumerate(self._rows) if face not in keep])
        for face in choice:
            if face not in self._rows:
                for row in self.program.face_rows(*face):
                    self._add(face, *row)
        self.active = [k for k, _ in choice]

    def solve(self, cutoff: float = inf) -> tuple[float, np.ndarray] | None:
        """Return value and point of the optimum, with the tangents that it needs.

        The value is infinite if the program is infeasible, and a lower bound if it is ``cutoff``
        or more.  The result is None if the back end fails, or returns numbers that are not finite.
        """
        for _ in range(REFINEMENTS):
            self._budget.tick()
            status = self._run()
            if status == self._infeasible:
                return inf, np.zeros(0)
            if status != self._optimal:
                return None
            value = self._base + float(self._lp.getInfo().objective_function_value)
            point = np.array(self._lp.getSolution().col_value)
            if not (isfinite(value) and np.isfinite(point).all()):
                return None
            if value >= cutoff or not self._add_tangents(point):
                break
        return value, point

    def solve_at(self, means: Sequence[np.ndarray]) -> np.ndarray | None:
        """Return the optimum with the best faces of ``means``, if there is one."""
        return self._solve_with_best(self.faces.margins(self.program.point_at(means)))

    def solve_near(self, means: Sequence[np.ndarray]) -> np.ndarray | None:
        """Return the optimum with the faces of largest clearance at ``means``, if there is one."""
        return self._solve_with_best(self.faces.clearances(self.program.point_at(means)))

    def _solve_with_best(self, values: np.ndarray) -> np.ndarray | None:
        """Return the optimum with the face of largest value (F,) of each disjunction, if any."""
        parts = np.split(values, self.faces.first[1:]) if self.program.disjunctions else []
        self.set_faces(tuple((k, int(part.argmax())) for k, part in enumerate(parts)))
        solution = self.solve()
        return None if solution is None or solution[0] == inf else solution[1]

    def reduced_cost(self, disjunction: Disjunction) -> float:
        """Return the reduced cost of a disjunction's loss.

        It is the least increase of the value per unit of loss: other losses may fall in return.
        """
        dual = float(self._lp.getSolution().col_dual[disjunction.loss])
        return max(dual, 0.0) if isfinite(dual) else 0.0

    def _add(
        self, face: tuple[int, int] | None, least: float, columns: np.ndarray, values: np.ndarray
    ) -> None:
        """Add the row of a chosen face or a tangent, or that of a cut if ``face`` is None."""
        self._lp.addRow(least, inf, len(columns), columns, values)
        self._rows.append(face)

    def _delete(self, obsolete: list[int]) -> None:
        """Delete added rows, which ``obsolete`` numbers in ascending order."""
        if obsolete:
            numbers = np.array(obsolete, dtype=np.int32) + self._first
            self._lp.deleteRows(len(numbers), numbers)
            gone = set(obsolete)
            self._rows = [face for n, face in enumerate(self._rows) if n not in gone]

    def _drop_tangents(self) -> None:
        """Delete the tangents that do not bind, if there are many.

        Where most of them bind, the limit is raised.
        """
        tangents = [n for n, face in enumerate(self._rows) if face == TANGENT]
        if len(tangents) <= self._most_tangents:
            return
        duals = np.array(self._lp.getSolution().row_dual)[self._first :]
        loose = [n for n in tangents if duals[n] == 0]
        if len(loose) < len(tangents) / 2:
            self._most_tangents = 2 * len(tangents)
        self._delete(loose)

    def _run(self) -> Any:
        """Solve the program; if that fails, solve it without a basis by the dual simplex method."""
        self._lp.run()
        status = self._lp.getModelStatus()
        if status in (self._optimal, self._infeasible):
            return status
        # The primal simplex method sometimes cannot decide that there is no solution.
        self._lp.clearSolver()
        self._lp.setOptionValue("simplex_strategy", 1)
        self._lp.run()
        self._lp.setOptionValue("simplex_strategy", OPTIONS["simplex_strategy"])
        return self._lp.getModelStatus()

    def _add_tangents(self, point: np.ndarray) -> bool:
        """Add tangents at the margins of chosen faces; return whether any was missing."""
        on = [k for k in self.active if self.program.disjunctions[k].margin is not None]
        if not on:
            return False
        margins = np.clip(point[self.faces.margin_columns[on]], 0.0, self.faces.caps[on])
        errors = objective.loss(self.program.game, margins) - point[self.faces.losses[on]]
        missing = False
        wrong = np.flatnonzero(errors * self.faces.weights[on] > CURVATURE).tolist()
        if wrong:
            self._drop_tangents()
        for n in wrong:
            if line := tangent(self.program.game, float(margins[n])):
                disjunction = self.program.disjunctions[on[n]]
                columns = np.array([disjunction.loss, disjunction.margin], dtype=np.int32)
                self._add(TANGENT, line[1], columns, np.array([1.0, -line[0]]))
                missing = True
        return missing


class Faces:
    """All faces of all disjunctions in arrays, to compute the margins of a point at once.

    Attributes
    ----------
    first : (K,) index of each disjunction's first face.
    times, caps, weights : (K,) times, caps and weights of the disjunctions.
    margin_columns, losses : (K,) columns of their margins and losses.
    lowest : (K,) the least loss of each disjunction.
    least : per disjunction, (F,) the least loss that each of its faces allows.
    """

    def __init__(self, disjunctions: Sequence[Disjunction]) -> None:
        faces = [face for disjunction in disjunctions for face in disjunction.faces]
        ends = np.cumsum([len(disjunction.faces) for disjunction in disjunctions], dtype=int)
        self.first = ends - [len(disjunction.faces) for disjunction in disjunctions]
        self.times = np.array([disjunction.time for disjunction in disjunctions], dtype=int)
        self.caps = np.array([disjunction.cap for disjunction in disjunctions])
        self.weights = np.array([disjunction.weight for disjunction in disjunctions])
        self.margin_columns = np.array(
            [disjunction.margin or 0 for disjunction in disjunctions], dtype=int
        )
        self.losses = np.array([disjunction.loss for disjunction in disjunctions], dtype=int)
        self.lowest = np.array([disjunction.lowest for disjunction in disjunctions])
        self.least = [
            np.array([face.least for face in disjunction.faces]) for disjunction in disjunctions
        ]
        rows = [clearance for face in faces for clearance in face.clearances]
        self._ends = len(faces[0].clearances) if faces else 1
        width = max((len(row.columns) for row in rows), default=0)
        self._columns = np.zeros((len(rows), width), dtype=int)
        self._values = np.zeros((len(rows), width))
        for k, row in enumerate(rows):
            self._columns[k, : len(row.columns)] = row.columns
            self._values[k, : len(row.values)] = row.values
        self._constants = np.array([row.constant for row in rows])
        self._units = np.array([row.unit for row in rows])

    def margins(self, point: np.ndarray) -> np.ndarray:
        """Return the margin of each face at the means of ``point``, over all of its instants."""
        return self._over_ends(face_margins(self._clearances(point), self._units))

    def clearances(self, point: np.ndarray) -> np.ndarray:
        """Return the clearance of each face at the means of ``point``, over all of its instants."""
        return self._over_ends(self._clearances(point))

    def _clearances(self, point: np.ndarray) -> np.ndarray:
        return (self._values * point[self._columns]).sum(axis=1) + self._constants

    def _over_ends(self, values: np.ndarray) -> np.ndarray:
        return values if self._ends == 1 else values.reshape(-1, self._ends).min(axis=1)


OPTIONS: dict[str, Any] = {
    "output_flag": False,
    "threads": 1,
    "presolve": "off",  # nodes differ by a row or two and continue from the last basis
    "solver": "simplex",
    "simplex_strategy": 4,  # primal: few steps between nodes, and duals that prune well
    "primal_simplex_bound_perturbation_multiplier": 0.0,
    "primal_feasibility_tolerance": tol.FEASIBILITY,
    "dual_feasibility_tolerance": tol.FEASIBILITY,
}
