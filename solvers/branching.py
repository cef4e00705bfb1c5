r"""Branching over faces, only where the relaxation is wrong.

A node has chosen faces for some moments (an encounter at a time); elsewhere margins are free.  Its
linear program is a lower bound, and its means are plans that the evaluator can price, so every
node may improve the plans in hand.  The moment whose true loss exceeds the program's the most is
branched on, a child per face, the face that the means keep clear of first.  One moment's choice
moves the means away at its neighbours too, so that few moments have to be decided at all.

Nodes are searched depth first: the next linear program then differs by a row or two, and the
simplex method goes on from where it was.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppg_env import objective
from ppg_env import tolerances as tol
from ppg_env.evaluate import evaluate
from ppg_env.game import Game
from ppg_env.objective import Weights
from ppg_env.plan import Plan, make_plan
from solvers.backend import FEASIBILITY
from solvers.clock import Clock
from solvers.fixed import INF, FixedProgram, Meeting, Moment, tangent
from solvers.found import Found
from solvers.solution import Status

CURVATURE = 1e-8
"""A tangent is added where the loss is above the program's by more than this, times its weight."""

REFINEMENTS = 30
"""Most rounds of tangents in one node; two or three are usual."""

Choice = tuple[tuple[int, int], ...]
"""Pairs (moment, face) that a node has switched on."""


@dataclass(frozen=True)
class Task:
    """One search: who moves, for what, and what the others do."""

    game: Game
    movers: tuple[int, ...]
    weights: Weights
    given: Mapping[int, Plan]


class Tree:
    """The search for fixed arrivals, below the cost of the plans in hand.

    Attributes
    ----------
    best : the cheapest plans known, those handed in or better ones.
    proved : lower bound on what these arrivals can cost, or the cost of ``best`` if that is less.
    """

    def __init__(
        self,
        task: Task,
        arrivals: Mapping[int, int],
        meetings: Sequence[Meeting],
        best: Found,
        clock: Clock,
    ) -> None:
        import highspy

        self.best, self.proved = best, INF
        self._task, self._clock = task, clock
        self._program = FixedProgram(task.game, arrivals, meetings, task.weights, task.given)
        self._base = sum(task.weights.time[i] * t for i, t in arrivals.items()) + sum(
            task.weights.encounter[m.index] * m.settled
            for m in meetings
            if task.weights.encounter[m.index] > 0
        )
        self._optimal = highspy.HighsModelStatus.kOptimal
        self._infeasible = highspy.HighsModelStatus.kInfeasible
        self._lp = highspy.Highs()
        for name, value in OPTIONS.items():
            self._lp.setOptionValue(name, value)
        self._lp.passModel(self._program.model())
        self._on: dict[int, int] = {}
        self._faces = _Faces(self._program.moments)

    def search(self) -> bool:
        """Search the tree; whether it was finished before the time was up."""
        stack: list[tuple[Choice, float]] = [((), -INF)]
        while stack:
            choice, bound = stack.pop()
            if bound >= self._cutoff:
                self.proved = min(self.proved, self.best.value)
                continue
            if self._clock.out:
                return False
            self._switch(dict(choice))
            answer = self._relaxed()
            if answer is None:
                return False
            value, point = answer
            if value >= self._cutoff:
                self.proved = min(self.proved, self.best.value)
                continue
            branch = self._branch(value, point)
            if branch is None:
                self.proved = min(self.proved, value)
                continue
            k, margins = branch
            children = self._children(k, margins, value, point)
            stack += [((*choice, (k, face)), least) for face, least in children]
        return True

    @property
    def _cutoff(self) -> float:
        return self.best.value - tol.MIP_GAP

    def _switch(self, wanted: dict[int, int]) -> None:
        """Let exactly the faces ``wanted`` hold."""
        moments = self._program.moments
        for k, p in list(self._on.items()):
            if wanted.get(k) != p:
                self._lp.changeRowBounds(moments[k].faces[p].row, -INF, INF)
                del self._on[k]
        for k, p in wanted.items():
            if k not in self._on:
                face = moments[k].faces[p]
                self._lp.changeRowBounds(face.row, -face.constant, INF)
                self._on[k] = p

    def _relaxed(self) -> tuple[float, np.ndarray] | None:
        """Value and point of the node's program, with all tangents that matter there.

        The value is infinite if the program has no solution; None if the back end gives up.
        """
        for _ in range(REFINEMENTS):
            self._lp.run()
            status = self._lp.getModelStatus()
            if status not in (self._optimal, self._infeasible):
                self._lp.clearSolver()  # once more, from scratch
                self._lp.run()
                status = self._lp.getModelStatus()
            if status == self._infeasible:
                return INF, np.zeros(0)
            if status != self._optimal:
                return None
            value = self._base + float(self._lp.getInfo().objective_function_value)
            point = np.array(self._lp.getSolution().col_value)
            if value >= self._cutoff or not self._refine(point):
                break
        return value, point

    def _refine(self, point: np.ndarray) -> bool:
        """Add tangents at the margins of chosen faces; whether any was missing."""
        missing = False
        for k in self._on:
            moment = self._program.moments[k]
            margin = float(np.clip(point[moment.margin], 0.0, moment.cap))
            error = self._loss(margin) - float(point[moment.loss])
            if error * moment.weight > CURVATURE and (line := tangent(self._task.game, margin)):
                columns = np.array([moment.loss, moment.margin], dtype=np.int32)
                self._lp.addRow(line[1], INF, 2, columns, np.array([1.0, -line[0]]))
                missing = True
        return missing

    def _loss(self, margin: float) -> float:
        return float(objective.loss(self._task.game, np.array(margin)))

    def _branch(self, value: float, point: np.ndarray) -> tuple[int, np.ndarray] | None:
        """The moment to decide next, and what its faces give; None if the point costs ``value``."""
        if not self._program.moments:
            self._price(point)
            return None
        margins = self._faces.margins(point)
        best = np.minimum(np.maximum.reduceat(margins, self._faces.first), self._faces.caps)
        losses = objective.loss(self._task.game, np.maximum(best, 0.0))
        losses = np.where(best >= 0, losses, INF) - point[self._faces.losses]
        gaps = self._faces.weights * losses
        gaps[list(self._on)] = 0.0
        error = float(np.maximum(gaps, 0.0).sum())
        if value + error < self.best.value:
            self._price(point)
        if error <= tol.REFINEMENT / 2:
            return None
        k = int(gaps.argmax())
        first = self._faces.first[k]
        return k, margins[first : first + len(self._program.moments[k].faces)]

    def _children(
        self, k: int, margins: np.ndarray, value: float, point: np.ndarray
    ) -> list[tuple[int, float]]:
        """Faces of moment k with bounds of the children's values, the likeliest last."""
        moment = self._program.moments[k]
        free = float(point[moment.loss])
        # The program let this moment's loss be as small as it may; a face makes it dearer.
        return [
            (p, value + moment.weight * max(self._loss(moment.faces[p].most) - free, 0.0))
            for p in margins.argsort(kind="stable").tolist()
        ]

    def _price(self, point: np.ndarray) -> None:
        """Keep the point's plans if the evaluator accepts them and finds them cheaper."""
        task, plans = self._task, []
        for i, agent in enumerate(task.game.agents):
            if i not in self._program.controls:
                plans.append(task.given[i])
                continue
            controls = np.zeros((task.game.horizon, agent.control_dim))
            controls[: self._program.arrivals[i]] = point[self._program.controls[i]]
            plans.append(make_plan(agent, controls))
        # The given plans may be predictions; the movers' were made from their controls just now.
        evaluation = evaluate(task.game, tuple(plans), as_given=True)
        if evaluation.complaints(task.movers):
            return
        value = evaluation.weighted(task.weights)
        if value < self.best.value:
            self.best = Found(Status.FEASIBLE, -INF, tuple(plans), evaluation, value)


class _Faces:
    """All faces of all moments side by side, to price a point at once.

    Attributes
    ----------
    first : (K,) where each moment's faces begin.
    caps, weights, losses : (K,) of the moments; ``losses`` are columns.
    """

    def __init__(self, moments: Sequence[Moment]) -> None:
        faces = [face for moment in moments for face in moment.faces]
        ends = np.cumsum([len(moment.faces) for moment in moments], dtype=int)
        self.first = ends - [len(moment.faces) for moment in moments]
        self.caps = np.array([moment.cap for moment in moments])
        self.weights = np.array([moment.weight for moment in moments])
        self.losses = np.array([moment.loss for moment in moments], dtype=int)
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
        # A face without noise counts fully or not at all.
        certain = np.where(clear >= -tol.LENGTH, np.inf, -np.inf)
        return np.divide(clear, self._units, out=certain, where=self._units > 0)


OPTIONS: dict[str, Any] = {
    "output_flag": False,
    "threads": 1,
    "presolve": "off",  # nodes differ by a row or two, and go on from the last basis
    "solver": "simplex",
    "primal_feasibility_tolerance": FEASIBILITY,
    "dual_feasibility_tolerance": FEASIBILITY,
}
