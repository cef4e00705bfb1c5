"""Actions of the PettingZoo environment: their spaces, and checks of what is passed to ``step``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from ppg_env.env.simulator import Simulator
from ppg_env.errors import InputError


class ActionReader:
    """Turns {agent: action} into the array of the first copy of ``simulator``.

    Attributes
    ----------
    spaces : action space of each of ``names`` (N,), the smallest box around its control sets.
    """

    def __init__(self, simulator: Simulator, names: Sequence[str]) -> None:
        self._index = {name: i for i, name in enumerate(names)}
        self._sizes = [agent.control_dim for agent in simulator.game.agents]
        self._array = np.zeros((1, *simulator.low.shape))
        low, high = (bound.astype(np.float32) for bound in (simulator.low, simulator.high))
        self.spaces = {
            name: Box(low[i, :size], high[i, :size])
            for i, (name, size) in enumerate(zip(names, self._sizes, strict=True))
        }

    def read(self, actions: dict[str, Any], acting: Sequence[str]) -> np.ndarray:
        """Return the actions (1, N, m) of the agents that are ``acting``.

        The array is reused; rows of other agents keep earlier values.

        Raises
        ------
        InputError
            If an action is missing, of the wrong shape or not finite, or if another is given.
        """
        for name in acting:
            if name not in actions:
                raise InputError(f"actions[{name!r}]", "is missing", "give one for each of agents")
            self._read_action(name, actions[name])
        if len(actions) != len(acting):
            extra = next(name for name in actions if name not in acting)
            problem = "has left the game" if extra in self._index else "is no agent"
            raise InputError(f"actions[{extra!r}]", problem, "give actions for env.agents only")
        return self._array

    def _read_action(self, name: str, action: Any) -> None:
        i = self._index[name]
        size = self._sizes[i]
        try:
            values = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            values = np.array(np.nan)
        if values.shape != (size,) or not np.isfinite(values).all():
            raise InputError(
                f"actions[{name!r}]",
                f"is {action!r}, not {size} finite numbers",
                f"give an array of shape ({size},)",
            )
        self._array[0, i, :size] = values
