"""Checks of what stable-baselines3 passes to the slots of :class:`baselines.vec_env.GameVecEnv`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ppg_env.env.actions import action_numbers
from ppg_env.errors import InputError, require
from ppg_env.support.validation import finite_array


def checked_weights(weights: Any) -> tuple[float, float] | None:
    """Return the range from which lam is drawn, None if it is not drawn.

    Raises
    ------
    InputError
        If it is no range of lam.
    """
    if weights is None:
        return None
    remedy = "give a range of lam, 0 <= low <= high < 1"
    ends = finite_array(weights, "weights", remedy)
    fit = ends.shape == (2,) and bool(0 <= ends[0] <= ends[1] < 1)
    require(fit, "weights", f"are {weights!r:.60}", remedy)
    return float(ends[0]), float(ends[1])


def check_modes(bootstrap: Any, render_mode: Any) -> None:
    """Raise :class:`InputError` unless these are a truth value and a mode."""
    truth = isinstance(bootstrap, (bool, np.bool_))
    require(truth, "bootstrap", f"is {bootstrap!r:.60}", "write True or False")
    known = render_mode is None or render_mode == "rgb_array"
    require(known, "render_mode", f"is {render_mode!r:.60}", "write rgb_array")


def common_options(options: Any) -> dict[str, Any]:
    """Return the reset options that all slots have.

    Raises
    ------
    InputError
        If they are not dictionaries, or differ.
    """
    remedy = "set one dictionary for all slots"
    listed = isinstance(options, (list, tuple)) and len(options) > 0
    fit = listed and all(isinstance(own, Mapping) for own in options)
    require(fit, "options", f"are {options!r:.60}", remedy)
    first, *others = options
    alike = all(other is first or not (other or first) for other in others)
    require(alike, "options", "differ between slots", remedy)
    return dict(first)


def slot_actions(actions: Any, shape: tuple[int, int]) -> np.ndarray:
    """Return ``actions`` as an array of this ``shape``, a row per slot.

    Raises
    ------
    InputError
        If they have another one, or are not numbers.
    """
    given = actions if isinstance(actions, np.ndarray) else action_numbers(actions)
    if given.shape != shape or given.dtype.kind not in "iuf":
        problem = f"are an array of shape {given.shape} and type {given.dtype}"
        raise InputError("actions", problem, f"give numbers of shape {shape}, a row per slot")
    return given
