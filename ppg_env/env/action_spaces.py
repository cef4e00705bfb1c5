"""The action spaces of the PettingZoo and Gymnasium environments."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import Box

from ppg_env.game.game import Game
from ppg_env.game.input_sets import bounds


def action_spaces(game: Game, *, projected: bool = True) -> list[Box]:
    """Return each agent's action space, the smallest box around its control sets.

    Where inputs are ``projected``, one that cannot vary has the range of the agent's widest input,
    about its only value: algorithms divide by the width of a space.
    """
    spaces: list[Box] = []
    for agent in game.agents:
        low, high = (np.asarray(bound, np.float32) for bound in bounds(agent.control))
        width = float((high - low).max()) or 2 * agent.control_unit
        fixed = (high <= low) & projected
        # At least the spacing of float32, or the two bounds would be rounded to one number.
        half = np.maximum(width / 2, 2 * np.spacing(np.abs(low)))
        low, high = np.where(fixed, low - half, low), np.where(fixed, high + half, high)
        spaces.append(Box(low.astype(np.float32), high.astype(np.float32)))
    return spaces
