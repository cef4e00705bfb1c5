r"""Panels: cost, time, safety and risk of each solution over lam, from the rows of a sweep.

All quantities are shifted, since ratios of the paper's negative costs have no meaning:

    objective   lam T + (1 - lam) sum (M' - s)      time   T      safety   sum (M' - s)

Lower is better.  They differ from the paper's by constants of each game.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.reproduction.extent import EQUILIBRIA, SOCIAL, Place
from benchmarks.sweeps import Row

QUANTITIES = ("objective", "time", "safety")


@dataclass(frozen=True)
class Curve:
    """One solution over lam; NaN where a cell has no result.  L values of lam, N agents.

    Attributes
    ----------
    objective, time, safety : (L, N), lower is better.
    crash : (L, 3) probability that any agent crashes: value, lower and upper limit (95 %).
    risk_bound : (L,) union bound on that probability.
    regret : (L,) largest certified regret of an agent; NaN if there is no certificate.
    status : (L,) status of the planner.
    reasons : (L,) why there is no result; empty where there is one.
    """

    objective: np.ndarray
    time: np.ndarray
    safety: np.ndarray
    crash: np.ndarray
    risk_bound: np.ndarray
    regret: np.ndarray
    status: tuple[str, ...]
    reasons: tuple[str, ...]

    def mean(self, quantity: str) -> np.ndarray:
        """Return the average over the agents, (L,)."""
        values: np.ndarray = getattr(self, quantity)
        return values.mean(axis=1)


@dataclass(frozen=True)
class Panel:
    """One row of the paper's figures in one setting."""

    place: Place
    lams: np.ndarray
    curves: Mapping[str, Curve]
    plans: Mapping[str, Sequence[Row]] = field(repr=False)

    @property
    def social(self) -> Curve:
        """The social optimum."""
        return self.curves[SOCIAL]

    def gap(self, equilibrium: str, quantity: str) -> np.ndarray:
        """Return the equilibrium's excess over the optimum for each agent, (L, N)."""
        above: np.ndarray = getattr(self.curves[equilibrium], quantity)
        below: np.ndarray = getattr(self.social, quantity)
        return above - below

    def mean_gap(self, equilibrium: str, quantity: str) -> np.ndarray:
        """Return the gap averaged over the agents, (L,)."""
        return self.gap(equilibrium, quantity).mean(axis=1)

    def band(self, quantity: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and the highest average among the equilibria, (L,) each."""
        means = np.array([self.curves[name].mean(quantity) for name in EQUILIBRIA])
        missing = np.isnan(means)
        low = np.where(missing, np.inf, means).min(axis=0)
        high = np.where(missing, -np.inf, means).max(axis=0)
        empty = missing.all(axis=0)
        return np.where(empty, np.nan, low), np.where(empty, np.nan, high)


def make_panel(place: Place, lams: Sequence[float], rows: Mapping[str, Sequence[Row]]) -> Panel:
    """Return the panel of ``rows``: for each solution, one row for each of ``lams``."""
    curves = {solution: _curve(chosen) for solution, chosen in rows.items()}
    return Panel(place, np.array(lams), curves, rows)


def _curve(rows: Sequence[Row]) -> Curve:
    return Curve(
        objective=np.array([_numbers(row.shifted_cost, row.agents) for row in rows]),
        time=np.array([_numbers(row.arrival, row.agents) for row in rows]),
        safety=np.array([_numbers(row.deficit, row.agents) for row in rows]),
        crash=np.array(
            [
                _numbers(
                    (
                        row.crash_probability,
                        row.crash_probability_low,
                        row.crash_probability_high,
                    ),
                    3,
                )
                for row in rows
            ]
        ),
        risk_bound=np.array([_numbers((row.risk_bound_any,), 1)[0] for row in rows]),
        regret=np.array([max(_numbers(row.regret, row.agents)) for row in rows]),
        status=tuple(row.status for row in rows),
        reasons=tuple(row.reason or "" for row in rows),
    )


def _numbers(values: Iterable[float | None] | None, count: int) -> list[float]:
    """Return ``values`` with NaN for missing ones."""
    if values is None:
        return [np.nan] * count
    return [np.nan if value is None else float(value) for value in values]
