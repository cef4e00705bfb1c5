"""Actions: checks of what is passed to ``step``, before the kernel reads it.

Every agent's inputs are finite numbers of at most :data:`ppg_env.tolerances.LARGEST` in size.
Those of agents that have left the game are ignored, whatever they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.compiled import compiled_kernel
from ppg_env.env.players import Player, View
from ppg_env.errors import InputError
from ppg_env.game.game import Game
from ppg_env.game.input_sets import bounds


def action_boxes(game: Game) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds (N, m) of all control sets of each agent, zero where it has no input."""
    m = max(agent.control_dim for agent in game.agents)
    low, high = np.zeros((2, len(game.agents), m))
    for i, agent in enumerate(game.agents):
        box = slice(agent.control_dim)
        low[i, box], high[i, box] = bounds(agent.control)
    return low, high


class ActionReader:
    """Turns {agent: action} into the array of one copy of ``game``, whose agents are ``names``."""

    def __init__(self, game: Game, names: Sequence[str]) -> None:
        self._index = {name: i for i, name in enumerate(names)}
        self._sizes = [agent.control_dim for agent in game.agents]
        self._array = np.zeros((1, len(names), max(self._sizes)))

    def read(self, actions: Mapping[str, Any], acting: Sequence[str]) -> np.ndarray:
        """Return the actions (1, N, m) of the agents that are ``acting``.

        The array is reused; rows of other agents keep earlier values.

        Raises
        ------
        InputError
            If an action is missing, of the wrong shape or not finite, or an agent is unknown.
        """
        array, index, sizes = self._array, self._index, self._sizes
        for name in acting:
            i = index[name]
            size = sizes[i]
            try:
                values = actions[name]
            except KeyError:
                remedy = "give one for each of agents"
                raise InputError(f"actions[{name!r}]", "is missing", remedy) from None
            if not (type(values) is np.ndarray and values.dtype.char in "df"):  # others take longer
                values = action_numbers(values)
            if values.shape != (size,):
                raise self._refusal(name, actions[name])
            array[0, i, :size] = values
        if not compiled_kernel().all_usable(array):  # also where an entry is not a number
            self._check_size(actions, acting)
        if len(actions) != len(acting):
            self.check_names(actions)
        return self._array

    def check_names(self, actions: Mapping[str, Any]) -> None:
        """Raise :class:`InputError` if ``actions`` has a name that is no agent of the game."""
        for name in actions:
            if name not in self._index:
                remedy = "give actions for agents of this game only"
                raise InputError(f"actions[{name!r}]", "is no agent", remedy)

    def _check_size(self, actions: Mapping[str, Any], acting: Sequence[str]) -> None:
        usable = (np.abs(self._array[0]) <= tol.LARGEST).all(axis=1)
        self._array[0, ~usable] = 0.0  # an earlier step may have been refused for it
        for name in acting:
            if not usable[self._index[name]]:
                raise self._refusal(name, actions[name])

    def _refusal(self, name: str, action: Any) -> InputError:
        size = self._sizes[self._index[name]]
        return InputError(
            f"actions[{name!r}]",
            f"is {action!r:.80}, not {size} finite numbers",
            f"give an array of shape ({size},) with numbers up to {tol.LARGEST:g} in size",
        )


def action_numbers(values: Any) -> np.ndarray:
    """Return ``values`` as a new array of floats, or a single NaN if they are none.

    Dates, texts and complex numbers are none, although NumPy would convert them.
    """
    try:
        array = np.asarray(values)
        return array.astype(np.float64) if array.dtype.kind in "biufO" else np.array(np.nan)
    except (TypeError, ValueError, OverflowError):  # ragged lists, objects, huge integers
        return np.array(np.nan)


def batch_of_actions(action: Any, out: np.ndarray) -> np.ndarray:
    """Return ``action`` as an array of the shape and type of ``out`` (C, N, m), which may be used.

    One action (N, m) or (1, N, m) holds for all copies.

    Raises
    ------
    InputError
        If it has another shape, or is not made of numbers.
    """
    ready = isinstance(action, np.ndarray) and action.shape == out.shape
    if ready and action.dtype == np.float64 and action.flags.carray:
        return action
    try:
        values = np.asarray(action)
        numbers = values.dtype.kind in "iuf"
    except ValueError:  # ragged lists
        numbers = False
    remedy = f"give an array of shape {out.shape}, or {out.shape[1:]} for all copies"
    if not numbers:
        raise InputError("action", f"is {action!r:.40}, not an array of numbers", remedy)
    if values.shape not in (out.shape, out.shape[1:], (1, *out.shape[1:])):
        raise InputError("action", f"has the shape {values.shape}", remedy)
    out[:] = values
    return out


def without_unusable(action: np.ndarray, moving: np.ndarray, sizes: Sequence[int]) -> np.ndarray:
    """Return ``action`` (C, N, m) with zeros for entries that are too large or not finite.

    Raises
    ------
    InputError
        If one of them is an input of an agent that moves, ``moving`` (C, N); agent i has the first
        ``sizes[i]`` inputs.
    """
    unusable = ~(np.abs(action) <= tol.LARGEST)
    owned = np.arange(action.shape[2]) < np.array(sizes)[:, None]
    for c, i in np.argwhere((unusable & owned & moving[:, :, None]).any(axis=2))[:1]:
        raise InputError(
            f"action[{c}, {i}]",
            f"is {action[c, i, : sizes[i]].tolist()!s:.80} for agent_{i} in copy {c}, not finite "
            "numbers",
            f"give numbers up to {tol.LARGEST:g} in size",
        )
    return np.where(unusable, 0.0, action)


def player_action(player: Player, view: View, agent: int, size: int) -> np.ndarray:
    """Return the actions (C, m) of the ``player`` of ``agent``, which has ``size`` inputs.

    Raises
    ------
    InputError
        If they are of another shape, or not numbers.
    """
    action, copies = np.asarray(player.act(view)), len(view.clock)
    if action.shape != (copies, size) or action.dtype.kind not in "iuf":
        raise InputError(
            f"player of agent_{agent}",
            f"returns an array of shape {action.shape} and type {action.dtype}",
            f"return numbers of shape ({copies}, {size}) from act, one row per copy",
        )
    return action
