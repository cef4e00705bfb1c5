r"""Control sets less the reserve that feedback needs.

    a' ubar_t + z sigma(a' K e_t) <= b,     sigma(a' K e_t)^2 = a' K Sigma(t) K' a

for every face (a, b) of U_t, with z = ``reserve``: the nominal control leaves room for what the
feedback u = ubar - K e asks z standard deviations of the time.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ppg_env.errors import InputError
from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import covariances
from ppg_env.game.input_sets import Controls, checked_controls
from ppg_env.game.polytope import Polytope


@lru_cache(maxsize=1024)
def planned_controls(agent: Agent, horizon: int) -> Controls:
    """Return the sets of nominal controls at steps 0..``horizon`` - 1, less the reserve.

    Raises
    ------
    InputError
        If the reserve leaves no control at some step.
    """
    if agent.reserve == 0 or not np.any(agent.gain):
        return agent.control
    spread = agent.gain @ covariances(agent, horizon)[:horizon] @ agent.gain.T
    pieces: list[tuple[int, Polytope]] = []
    for step in range(horizon):
        admissible = agent.control_at(step)
        normals = admissible.normals
        variance = np.einsum("fi,ij,fj->f", normals, spread[step], normals)
        rounding = 1e-14 * np.abs(spread[step]).max()  # across a flat set, nothing may be asked
        asked = np.sqrt(np.where(variance > rounding, variance, 0.0))
        try:
            reduced = _reduced(admissible, agent.reserve * asked)
        except InputError:
            raise InputError(
                "reserve",
                f"leaves no control at step {step}",
                "lower the reserve or the gain, or allow larger controls",
            ) from None
        if not pieces or pieces[-1][1] != reduced:
            pieces.append((step, reduced))
    return checked_controls(pieces)


def _reduced(admissible: Polytope, room: np.ndarray) -> Polytope:
    """Return the set whose face p is moved inwards by ``room[p]``."""
    if not room.any():
        return admissible
    if admissible.kind == "box":
        # Faces come in opposite pairs with equal room; the kind stays the same.
        return Polytope.box(admissible.params[0] - 2 * room[: admissible.dim])
    return Polytope.from_halfspaces(admissible.normals, admissible.offsets - room)
