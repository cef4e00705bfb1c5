"""Bounds of linear programs recomputed from multipliers: nothing of the back end is believed.

For any multipliers y of rows L <= A x <= U, with x in a box, c'x is at least

    sum_i (y_i L_i if y_i > 0 else y_i U_i)  +  sum_j min over x_j of (c - A'y)_j x_j

With c = 0, a positive bound proves that there is no such x (Farkas).
"""

from __future__ import annotations

from math import inf

import highspy
import numpy as np
import pytest
from scipy.sparse import csc_array, csr_array

from ppg_env import make_game
from ppg_env.game import objective
from solvers.budget import Budget
from solvers.engine.arrival_search import engine_search
from solvers.engine.node_lp import Relaxation

BOX = 100.0
"""Free columns are positions: all of these games lie in a box of this size."""


class Program:
    """A copy of the rows, columns and costs of a program of the back end."""

    def __init__(self, lp):
        matrix, shape = lp.a_matrix_, (lp.num_row_, lp.num_col_)
        by_column = matrix.format_ == highspy.MatrixFormat.kColwise
        parts = np.array(matrix.value_), np.array(matrix.index_), np.array(matrix.start_)
        self.transposed = (csc_array if by_column else csr_array)(parts, shape=shape).T
        self.least, self.most = np.array(lp.row_lower_), np.array(lp.row_upper_)
        self.low = np.maximum(np.array(lp.col_lower_), -BOX)
        self.high = np.minimum(np.array(lp.col_upper_), BOX)
        self.cost = np.array(lp.col_cost_)

    def bound(self, multipliers, cost):
        """Return the lower bound on cost'x that the multipliers prove."""
        y = np.where((multipliers > 0) & (self.least == -inf), 0.0, multipliers)
        y = np.where((y < 0) & (self.most == inf), 0.0, y)
        limits = np.where(y > 0, self.least, np.where(y < 0, self.most, 0.0))
        reduced = cost - self.transposed @ y
        return y @ limits + np.minimum(reduced * self.low, reduced * self.high).sum()


def farkas(lp):
    """Return multipliers that prove a program infeasible, of the dual simplex method."""
    other = highspy.Highs()
    for name, value in (("output_flag", False), ("presolve", "off"), ("simplex_strategy", 1)):
        other.setOptionValue(name, value)
    other.passModel(lp)
    other.run()
    return np.array(other.getDualRay()[2])


@pytest.mark.parametrize(
    ("name", "options", "nodes"),
    [("circle", {}, 150), ("head_on", {"objective": "risk", "speed": "l1"}, 150)],
)
def test_multipliers_prove_every_bound_and_every_dead_end(monkeypatch, name, options, nodes):
    solve, slack, dead_ends = Relaxation.solve, [], []

    def proved(self, cutoff=inf):
        solution = solve(self, cutoff)
        program = Program(self._lp.getLp())
        if solution is not None and solution[0] == inf:
            ray, nothing = farkas(self._lp.getLp()), np.zeros(len(program.cost))
            dead_ends.append(max(program.bound(y, nothing) for y in (ray, -ray)))
        elif solution is not None:
            value = self._lp.getInfo().objective_function_value
            y = np.array(self._lp.getSolution().row_dual)
            slack.append(value - program.bound(y, program.cost))
        return solution

    monkeypatch.setattr(Relaxation, "solve", proved)
    weights = objective.social(make_game(name, **options))
    engine_search(weights, range(len(weights.time)), None, Budget(None, nodes))
    assert max(slack) <= 1e-6
    assert dead_ends
    assert min(dead_ends) > 1e-6
