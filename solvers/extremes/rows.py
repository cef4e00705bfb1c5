"""Columns and rows of a mixed-integer program, collected one at a time and solved by HiGHS."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from math import inf

import numpy as np

from solvers.budget import Budget

Terms = Mapping[int, float]
"""Coefficients by column."""


class Outcome(Enum):
    """How a search for a point ended."""

    POINT = "point"
    NONE = "none"
    STOPPED = "stopped"


class Rows:
    """A system of rows  least <= a'x <= most  with bounded and partly binary columns."""

    def __init__(self) -> None:
        self._low: list[float] = []
        self._high: list[float] = []
        self._binary: list[int] = []
        self._rows: list[tuple[dict[int, float], float, float]] = []

    def column(self, low: float, high: float) -> int:
        """Add a column and return its number."""
        self._low.append(low)
        self._high.append(high)
        self._binary.append(0)
        return len(self._low) - 1

    def binary(self) -> int:
        """Add a binary column and return its number."""
        column = self.column(0.0, 1.0)
        self._binary[column] = 1
        return column

    def row(self, terms: Terms, least: float = -inf, most: float = inf) -> int:
        """Add a row and return its number."""
        self._rows.append(({k: v for k, v in terms.items() if v}, least, most))
        return len(self._rows) - 1

    def change(self, row: int, least: float, most: float) -> None:
        """Replace the limits of a row."""
        self._rows[row] = self._rows[row][0], least, most

    def point(self, budget: Budget, nodes: int) -> tuple[Outcome, np.ndarray]:
        """Return some point that satisfies all rows, or that there is none."""
        from scipy.optimize import Bounds, LinearConstraint, milp
        from scipy.sparse import csr_array

        entries = [(n, k, v) for n, (row, _, _) in enumerate(self._rows) for k, v in row.items()]
        numbers, columns, values = zip(*entries, strict=True)
        matrix = csr_array((values, (numbers, columns)), shape=(len(self._rows), len(self._low)))
        limits = np.array([row[1:] for row in self._rows])
        options: dict[str, float] = {"node_limit": nodes}
        if budget.left is not None:
            options["time_limit"] = max(budget.left, 0.01)
        answer = milp(
            np.zeros(len(self._low)),
            integrality=np.array(self._binary),
            bounds=Bounds(np.array(self._low), np.array(self._high)),
            constraints=LinearConstraint(matrix, limits[:, 0], limits[:, 1]),
            options=options,
        )
        if answer.x is not None and np.isfinite(answer.x).all():
            return Outcome.POINT, np.array(answer.x)
        infeasible = answer.status == 2 and answer.x is None
        return (Outcome.NONE if infeasible else Outcome.STOPPED), np.zeros(0)
