r"""A node's linear program: the program of given arrivals with some faces switched on.

It is kept from node to node, so that the simplex method goes on from where it was.  Rows of three
kinds come and go:

    faces       a_p' (r_i - r_j) - b_p >= unit_p s      while the node has chosen face p
    tangents    l >= c(q) + c'(q) (s - q)               added where an answer sits, kept
    cuts      sum_e omega_e sum_t l_et >= least       kept
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game import objective
from ppg_env.game.margins import face_margins
from solvers.budget import Budget
from solvers.engine.fixed_arrival_lp import INF, Disjunction, FixedProgram, tangent
from solvers.reference.cvxpy_backend import FEASIBILITY

CURVATURE = 1e-8
"""A tangent is added where the loss is above the program's by more than this, times its weight."""

REFINEMENTS = 30
"""Most rounds of tangents in one node; two or three are usual."""

Choice = tuple[tuple[int, int], ...]
"""Pairs (disjunction, face) that a node has switched on."""


class Relaxation:
    """The linear program of fixed arrivals, solved again and again with other faces.

    Parameters
    ----------
    program : what is solved.
    spent : cost of the arrivals, which is added to every value.

    Attributes
    ----------
    faces : all faces of the program, to price points.
    on : disjunctions whose faces are switched on.
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
        self._lp.passModel(program.model())
        self._first, self._rows = self._lp.getNumRow(), list[tuple[int, int] | None]()
        self.on: list[int] = []

    def learn(self, encounters: Sequence[int], least: float) -> None:
        """Let the weighted losses of ``encounters`` be ``least`` at least."""
        undecided = [m for m in self.program.disjunctions if m.encounter in encounters]
        least = least - sum(self.program.fixed_loss.get(e, 0.0) for e in encounters)
        if undecided and least > tol.MIP_GAP:
            columns = np.array([m.loss for m in undecided], dtype=np.int32)
            self._add(None, least, columns, np.array([m.weight for m in undecided]))

    def switch(self, wanted: Choice) -> None:
        """Let exactly the faces ``wanted`` hold."""
        keep = set(wanted)
        gone = [n for n, made in enumerate(self._rows) if made is not None and made not in keep]
        if gone:
            numbers = np.array(gone, dtype=np.int32) + self._first
            self._lp.deleteRows(len(numbers), numbers)
            self._rows = [made for made in self._rows if made is None or made in keep]
        for made in wanted:
            if made not in self._rows:
                self._add(made, *self.program.row(*made))
        self.on = [k for k, _ in wanted]

    def solve(self, cutoff: float = INF) -> tuple[float, np.ndarray] | None:
        """Value and point of the program, with all tangents that matter there.

        A value of ``cutoff`` or more may be too low.  It is infinite if the program has no
        solution; None if the back end gives up.
        """
        for _ in range(REFINEMENTS):
            self._budget.tick()
            status = self._run()
            if status == self._infeasible:
                return INF, np.zeros(0)
            if status != self._optimal:
                return None
            value = self._base + float(self._lp.getInfo().objective_function_value)
            point = np.array(self._lp.getSolution().col_value)
            if value >= cutoff or not self._refine(point):
                break
        return value, point

    def settle(self, means: Sequence[np.ndarray]) -> np.ndarray | None:
        """The best point with the faces that count for ``means``, if there is one."""
        margins = self.faces.margins(self.program.point(means))
        best = [part.argmax() for part in np.split(margins, self.faces.first[1:])]
        self.switch(tuple((k, int(p)) for k, p in enumerate(best) if self.program.disjunctions))
        answer = self.solve()
        return None if answer is None or answer[0] == INF else answer[1]

    def price(self, disjunction: Disjunction) -> float:
        """What a unit more of a disjunction's loss costs at least, by its reduced cost.

        The program let it be as small as it may; another loss may shrink in return.
        """
        return max(float(self._lp.getSolution().col_dual[disjunction.loss]), 0.0)

    def _add(
        self, made: tuple[int, int] | None, least: float, columns: np.ndarray, values: np.ndarray
    ) -> None:
        """Add a row, for a chosen face or for good."""
        self._lp.addRow(least, INF, len(columns), columns, values)
        self._rows.append(made)

    def _run(self) -> Any:
        """Solve the program as it is; from scratch and with the dual simplex if need be."""
        self._lp.run()
        status = self._lp.getModelStatus()
        if status in (self._optimal, self._infeasible):
            return status
        # The primal simplex method sometimes cannot tell that there is no solution.
        self._lp.clearSolver()
        self._lp.setOptionValue("simplex_strategy", 1)
        self._lp.run()
        self._lp.setOptionValue("simplex_strategy", OPTIONS["simplex_strategy"])
        return self._lp.getModelStatus()

    def _refine(self, point: np.ndarray) -> bool:
        """Add tangents at the margins of chosen faces; whether any was missing."""
        on = [k for k in self.on if self.program.disjunctions[k].margin is not None]
        if not on:
            return False
        margins = np.clip(point[self.faces.margin_columns[on]], 0.0, self.faces.caps[on])
        errors = objective.loss(self.program.game, margins) - point[self.faces.losses[on]]
        missing = False
        for n in np.flatnonzero(errors * self.faces.weights[on] > CURVATURE).tolist():
            if line := tangent(self.program.game, float(margins[n])):
                disjunction = self.program.disjunctions[on[n]]
                columns = np.array([disjunction.loss, disjunction.margin], dtype=np.int32)
                self._add(None, line[1], columns, np.array([1.0, -line[0]]))
                missing = True
        return missing


class Faces:
    """All faces of all disjunctions side by side, to price a point at once.

    Attributes
    ----------
    first : (K,) where each disjunction's faces begin.
    times, caps, weights, margin_columns, losses : (K,) of the disjunctions; the last two are
    columns. lowest : (K,) the least loss of each disjunction.
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
        width = max((len(face.columns) for face in faces), default=0)
        self._columns = np.zeros((len(faces), width), dtype=int)
        self._values = np.zeros((len(faces), width))
        for k, face in enumerate(faces):
            self._columns[k, : len(face.columns)] = face.columns
            self._values[k, : len(face.values)] = face.values
        self._constants = np.array([face.constant for face in faces])
        self._units = np.array([face.unit for face in faces])

    def margins(self, point: np.ndarray) -> np.ndarray:
        """The margin that each face gives the means of ``point``."""
        clear = (self._values * point[self._columns]).sum(axis=1) + self._constants
        return face_margins(clear, self._units)


OPTIONS: dict[str, Any] = {
    "output_flag": False,
    "threads": 1,
    "presolve": "off",  # nodes differ by a row or two, and go on from the last basis
    "solver": "simplex",
    "simplex_strategy": 4,  # primal: few steps from node to node, and duals that prune well
    "primal_simplex_bound_perturbation_multiplier": 0.0,
    "primal_feasibility_tolerance": FEASIBILITY,
    "dual_feasibility_tolerance": FEASIBILITY,
}
