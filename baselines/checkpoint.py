"""Checkpoints of a training: the state of its models, and how many turns they have taken.

A checkpoint holds tensors only and is read back with ``weights_only``: loading one runs no code.
"""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.buffers import ReplayBuffer

from ppg_env.errors import InputError, require
from ppg_env.support.atomic_write import write_atomically


def save_checkpoint(path: Path, fingerprint: str, models: Sequence[Any], turns: int) -> None:
    """Write the state of ``models`` after ``turns`` turns."""
    state = {
        "fingerprint": fingerprint,
        "turns": turns,
        "learners": [_state(model) for model in models],
    }
    content = io.BytesIO()
    torch.save(state, content)
    write_atomically(path, content.getvalue())


def restore_checkpoint(path: Path | None, fingerprint: str, models: Sequence[Any]) -> int:
    """Load the checkpoint into ``models`` if there is one; return the number of turns taken.

    Raises
    ------
    InputError
        If the checkpoint belongs to another training, or cannot be read.
    """
    if path is None or not path.exists():
        return 0
    try:
        state = torch.load(path, weights_only=True)
        stored, turns, saved = state["fingerprint"], state["turns"], state["learners"]
    except Exception as error:  # damaged files raise errors of many kinds
        raise InputError(
            os.fspath(path),
            f"cannot be read ({type(error).__name__})",
            "remove it to start from the beginning",
        ) from None
    require(
        stored == fingerprint,
        os.fspath(path),
        "is the checkpoint of another training",
        "remove it to start from the beginning, or repeat the command that made it",
    )
    for model, model_state in zip(models, saved, strict=True):
        _load(model, model_state)
    return int(turns)


def _state(model: Any) -> dict[str, Any]:
    state = {"parameters": model.get_parameters(), "steps": model.num_timesteps}
    buffer = getattr(model, "replay_buffer", None)
    if buffer is not None:
        state["buffer"] = {key: torch.as_tensor(array) for key, array in _arrays(buffer).items()}
        state["position"] = [buffer.pos, int(buffer.full)]
    return state


def _load(model: Any, state: dict[str, Any]) -> None:
    model.set_parameters(state["parameters"])
    model.num_timesteps = state["steps"]
    buffer = getattr(model, "replay_buffer", None)
    if buffer is not None:
        for key, array in _arrays(buffer).items():
            array[:] = state["buffer"][key].numpy()
        buffer.pos, buffer.full = state["position"][0], bool(state["position"][1])


def _arrays(buffer: ReplayBuffer) -> dict[str, np.ndarray]:
    names = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
    return {name: getattr(buffer, name) for name in names}
