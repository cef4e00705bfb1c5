"""Groups of agents, specs of TorchRL's entries, and checks of actions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torchrl.data import Bounded, Categorical, Unbounded
from torchrl.envs.utils import MarlGroupMapType, check_marl_grouping

from ppg_env.env.action_spaces import action_spaces
from ppg_env.env.simulator import Simulator
from ppg_env.errors import require


def group_agents(
    wanted: MarlGroupMapType | Mapping[str, Sequence[str]] | None, names: list[str]
) -> dict[str, list[str]]:
    """Return the names of agents by group, by default by their stems as TorchRL has it."""
    if isinstance(wanted, MarlGroupMapType):
        return dict(wanted.get_group_map(names))
    if wanted is not None:
        groups = {group: list(members) for group, members in wanted.items()}
        fits = sorted(name for members in groups.values() for name in members) == sorted(names)
        require(fits, "group_map", f"is {wanted!r:.80}", "put every agent in one group")
        check_marl_grouping(groups, names)
        return groups
    groups = {}
    for name in names:
        stem, _, number = name.rpartition("_")
        if not (stem and number.isdigit()):
            return {"agents": names}
        groups.setdefault(stem, []).append(name)
    return {"agents": names} if list(groups) == ["agent"] else groups


def selection(members: list[int]) -> Any:
    """Return an index for the agents ``members``, a slice where they are consecutive."""
    first = members[0]
    consecutive = members == list(range(first, first + len(members)))
    return slice(first, first + len(members)) if consecutive else np.array(members)


def padded_boxes(simulator: Simulator) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds (N, m) of actions; an input that an agent does not have is in [-1, 1]."""
    shape = simulator.low.shape
    low, high = np.full(shape, -1.0, np.float32), np.full(shape, 1.0, np.float32)
    spaces = action_spaces(simulator.game, projected=simulator.rules.saturation == "clip")
    for i, space in enumerate(spaces):
        low[i, : space.shape[0]], high[i, : space.shape[0]] = space.low, space.high
    return low, high


def checked_action(given: Any, group: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return the entry ``group, "action"`` as an array of floats of this ``shape`` (C, G, m).

    Raises
    ------
    InputError
        If it is missing, has another shape, or is not made of real numbers.
    """
    place, remedy = f"{group}.action", f"give numbers of shape (copies, agents, inputs) = {shape}"
    require(given is not None, place, "is missing", remedy)
    real = given.dtype != torch.bool and not given.is_complex()
    problem = f"has the shape {tuple(given.shape)} and the type {given.dtype}"
    require(given.shape == shape and real, place, problem, remedy)
    numbers: np.ndarray = given.detach().to("cpu", torch.float32).numpy()
    return numbers


def flags(shape: tuple[int, ...], names: Sequence[str]) -> dict[str, Any]:
    """Return the specs of boolean entries of a shape, by name."""
    return {name: Categorical(2, shape=shape, dtype=torch.bool) for name in names}


def reals(shape: tuple[int, ...]) -> Any:
    """Return the spec of any numbers of a shape."""
    return Unbounded(shape=shape, dtype=torch.float32)


def box(low: np.ndarray, high: np.ndarray, shape: tuple[int, ...]) -> Any:
    """Return the spec of numbers between ``low`` and ``high``, which repeat to ``shape``."""
    if np.isinf(low).all() and np.isinf(high).all():
        return reals(shape)
    bounds = [torch.from_numpy(np.broadcast_to(side, shape).copy()) for side in (low, high)]
    return Bounded(bounds[0], bounds[1], shape=shape, dtype=torch.float32)
