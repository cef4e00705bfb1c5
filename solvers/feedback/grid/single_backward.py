"""Dynamic programming backwards in time for an agent without others that it observes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solvers.feedback.grid.backward import STATIONARY
from solvers.feedback.grid.single_kernels import step_back
from solvers.feedback.grid.single_model import SingleModel


def single_stages(model: SingleModel) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield costs (K,) after a move and before it, from the last step backwards.

    The stages end where they are stationary.  The costs before a move are overwritten.
    """
    value, later = np.zeros(model.size, np.float32), None
    for clock in reversed(range(model.rules.steps(model.game))):
        field = model.noise.traffic(value)
        step_back(model.mover(clock), model.harm(clock), field, float(model.own.lam), value)
        yield field, value
        settled = later is not None and float(np.abs(field - later).max()) < STATIONARY
        if settled and model.clock_free:
            return
        later = field
