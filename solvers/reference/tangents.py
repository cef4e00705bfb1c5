r"""Tangents of the crash-risk curve: lower bounds of a convex loss, refined at the solutions.

For s >= 0 the loss c(s) of :mod:`ppg_env.game.objective` is convex, so each tangent

    c(q) + c'(q) (s - q)  <=  c(s)

keeps the program a valid lower bound.  A table starts with the same tangents at every event;
others are added at the margins of solutions until model and evaluator agree.
"""

from __future__ import annotations

import cvxpy as cp
import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game import objective
from ppg_env.game.game import Game

STATIC = 16
"""Tangent points of a new table, between 0 and the cap."""

SLOTS = 12
"""Tangents that refinement may add at each event; the oldest are replaced."""


class TangentTable:
    """Tangents of one encounter: ``slopes`` and ``intercepts``, parameters of shape (K, Q)."""

    def __init__(self, game: Game, steps: int) -> None:
        self._game = game
        exact = game.objective == "margin"
        # Curvature is largest near 0.7 and negligible beyond 3: points thin out towards the cap.
        cap = float(game.margin_cap)
        points = np.array([cap]) if exact else cap * np.linspace(0, 1, STATIC) ** 1.4
        self._static = np.tile(points, (steps, 1))
        self.count = 1 if exact else STATIC + SLOTS
        self.slopes = cp.Parameter((steps, self.count))
        self.intercepts = cp.Parameter((steps, self.count))
        self.reset()

    def reset(self) -> None:
        """Remove all refinements."""
        spare = self.count - self._static.shape[1]
        self._points = np.hstack([self._static, np.repeat(self._static[:, -1:], spare, axis=1)])
        self._next = 0
        self._write()

    def add(self, margins: np.ndarray) -> None:
        """Add tangents at ``margins`` (K,), one per event."""
        slot = self._static.shape[1] + self._next % SLOTS
        self._next += 1
        self._points[:, slot] = np.clip(margins, 0.0, self._game.margin_cap)
        self._write()

    def model_loss(self, margins: np.ndarray) -> np.ndarray:
        """Return (K,) losses that the tangents give to ``margins`` (K,)."""
        return (self.slopes.value * margins[:, None] + self.intercepts.value).max(axis=1)

    def _write(self) -> None:
        slopes = objective.loss_slope(self._game, self._points)
        intercepts = objective.loss(self._game, self._points) - slopes * self._points
        # Back ends drop tiny coefficients but keep the constant, which would lift the tangent
        # above the curve; the least value of the curve is still a bound.
        flat = np.abs(slopes) < tol.FLAT_SLOPE
        least = float(objective.loss(self._game, np.array(self._game.margin_cap)))
        self.slopes.value = np.where(flat, 0.0, slopes)
        self.intercepts.value = np.where(flat, least, intercepts)
