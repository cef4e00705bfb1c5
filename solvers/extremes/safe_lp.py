r"""Linear programs whose bounds do not depend on the back end's word.

    minimise c'x   subject to   low <= x <= high,   least <= A x <= most

For any multipliers y of the rows, with d = c - A'y,

    c'x  >=  sum_r min(y_r least_r, y_r most_r)  +  sum_k min(d_k low_k, d_k high_k),

so the back end's multipliers give a bound whether or not it solved the program.  Columns are
bounded; a multiplier that would count an infinite side of its row is set to zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ppg_env import tolerances as tol


class Minimum(NamedTuple):
    """A proved lower bound, and the point (n,) that the back end returned, if it is finite."""

    bound: float
    point: np.ndarray | None


class SafeProgram:
    """One program, minimised for several costs in turn from the last basis.

    Parameters
    ----------
    low, high : (n,) finite bounds of the columns.
    rows : (r, n) coefficients.
    least, most : (r,) bounds of the rows, infinite on at most one side.
    """

    def __init__(
        self,
        low: np.ndarray,
        high: np.ndarray,
        rows: np.ndarray,
        least: np.ndarray,
        most: np.ndarray,
    ) -> None:
        import highspy

        self.low, self.high = np.array(low), np.array(high)
        self._rows, self._least, self._most = rows, least, most
        self._lp = highspy.Highs()
        for name, value in (
            ("output_flag", False),
            ("threads", 1),
            ("presolve", "off"),
            ("solver", "simplex"),
            ("simplex_strategy", 4),  # primal: only the costs differ
            ("primal_feasibility_tolerance", tol.FEASIBILITY),
        ):
            self._lp.setOptionValue(name, value)
        model = highspy.HighsLp()
        model.num_col_, model.num_row_ = len(low), len(rows)
        model.col_cost_ = np.zeros(len(low))
        model.col_lower_, model.col_upper_ = self.low, self.high
        model.row_lower_, model.row_upper_ = least, most
        model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        nonzero = rows != 0
        model.a_matrix_.start_ = np.append(0, nonzero.sum(axis=1).cumsum()).astype(np.int32)
        model.a_matrix_.index_ = np.nonzero(nonzero)[1].astype(np.int32)
        model.a_matrix_.value_ = rows[nonzero]
        self._lp.passModel(model)
        self._columns = np.arange(len(low), dtype=np.int32)

    def fix(self, column: int, value: float) -> None:
        """Fix a column at a value."""
        self.low[column] = self.high[column] = value
        self._lp.changeColBounds(column, value, value)

    def minimise(self, cost: np.ndarray) -> Minimum:
        """Return a proved lower bound on ``cost`` . x, and the back end's point."""
        self._lp.changeColsCost(len(cost), self._columns, cost)
        self._lp.run()
        solution = self._lp.getSolution()
        duals = np.array(solution.row_dual) if solution.dual_valid else np.zeros(len(self._rows))
        point = np.array(solution.col_value) if solution.value_valid else None
        if point is not None and not np.isfinite(point).all():
            point = None
        return Minimum(self._bound(cost, duals), point)

    def _bound(self, cost: np.ndarray, duals: np.ndarray) -> float:
        side = np.where(duals > 0, self._least, self._most)
        usable = np.isfinite(duals) & np.isfinite(side)
        duals, side = np.where(usable, duals, 0.0), np.where(usable, side, 0.0)
        reduced = cost - duals @ self._rows
        return float(duals @ side + np.minimum(reduced * self.low, reduced * self.high).sum())
