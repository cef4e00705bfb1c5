"""Costs of an agent alone on a finer grid, by which look-ahead corrects those of the joint grid.

Noise is often smaller than the cells of the joint grid, so that an agent that aims at its arrival
region by an interpolant of these cells arrives later than it could.  Far from each other, agents
cost what each costs alone, which a grid of two dimensions gives with finer cells:

    C(y_0, y_1) + D_0(y_0) + D_1(y_1),    D_i = C_i on the finer grid - C_i on the joint grid's

The agent's own D is all that its choice depends on.
"""

from __future__ import annotations

import numpy as np

from solvers.feedback.grid.action_price import Body, Cells, subtract_interpolant
from solvers.feedback.grid.joint_model import JointModel
from solvers.feedback.grid.single_backward import single_stages
from solvers.feedback.grid.single_model import SingleModel, make_single_model
from solvers.feedback.grid.state_grid import AXES, Grid

FINENESS = 2
"""Cells of the finer grid per cell of the joint grid, along each axis."""


class FinerCosts:
    """Differences of the costs of ``agent`` alone, per number of steps left.

    ``alone`` (S, K) are its costs on the joint grid, of which the last row stands for all further
    steps if they are ``stationary``.  There is no finer grid where the state has
    components that are no positions.
    """

    def __init__(self, model: JointModel, agent: int, alone: np.ndarray, stationary: bool) -> None:
        self._model, self._agent = model, agent
        self._alone, self._stationary = alone, stationary
        self._fields: list[np.ndarray] = []
        self._single: SingleModel | None = None
        if model.game.agents[agent].state_dim == model.game.dim:
            step = model.step / FINENESS
            self._single = make_single_model(model.game, model.rules, agent, (), step)
            self._fields = [field for field, _ in single_stages(self._single)]
        self._gaps: dict[int, np.ndarray] = {}

    def put(self, body: Body, clock: int) -> Body:
        """Return ``body`` with the differences at ``clock``."""
        if self._single is None:
            return body
        left = max(self._model.rules.steps(self._model.game) - clock, 1)
        left = min(left, len(self._alone))
        finer, coarse = _cells(self._single.grid), self._model.grids[self._agent]
        if left not in self._gaps:
            settled = self._stationary and left == len(self._alone)
            field = self._fields[-1 if settled else min(left, len(self._fields)) - 1]
            gap = field.reshape(finer.shape).astype(np.float64)
            alone = self._alone[left - 1].astype(np.float64)
            subtract_interpolant(gap, finer, _cells(coarse), alone.reshape(coarse.shape))
            self._gaps[left] = gap
        return body._replace(
            finer_low=finer.low, finer_step=finer.step, finer_shape=finer.shape,
            gap=self._gaps[left],
        )  # fmt: skip


def _cells(grid: Grid) -> Cells:
    """Return the first two axes of a grid."""
    return Cells(grid.low[:AXES].copy(), grid.step[:AXES].copy(), np.array(grid.shape[:AXES]))
