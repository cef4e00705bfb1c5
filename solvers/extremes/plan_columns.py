"""The controls of an agent as columns of a program, with the constraints of its plan."""

from __future__ import annotations

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.input_sets import set_at
from ppg_env.game.plan_constraints import plan_constraints
from ppg_env.game.reserve import planned_controls
from solvers.extremes.rows import Rows


def add_plans(program: Rows, game: Game, i: int, arrival: int) -> np.ndarray:
    """Add the controls (T, m) of agent ``i``, which arrives in time; return their columns."""
    agent = game.agents[i]
    sets = planned_controls(agent, game.horizon)
    bounds = [set_at(sets, t).bounds for t in range(arrival)]
    columns = np.array([[program.column(*pair) for pair in zip(*b, strict=True)] for b in bounds])
    fixed = plan_constraints(agent, arrival, game.horizon)
    unbounded = np.full(len(fixed.offsets), -np.inf), np.full(len(fixed.room), -np.inf)
    for matrix, least, most in (
        (fixed.faces, unbounded[0], fixed.offsets),
        (fixed.inside, unbounded[1], fixed.room),
        (fixed.effect, fixed.change, fixed.change),
    ):
        for row, low, high in zip(matrix, least.tolist(), most.tolist(), strict=True):
            if (row != 0).sum() > 1 or low == high:
                program.row(dict(zip(columns.ravel().tolist(), row, strict=True)), low, high)
    return columns
