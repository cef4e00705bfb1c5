"""Learned players: train them, load them, play them, and ask how far from equilibrium they are.

Names are loaded when first used: training needs the extra ``rl`` (stable-baselines3, torch),
playing does not.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from baselines.bridge import GameVecEnv
    from baselines.evaluation import judge
    from baselines.export import export_policy
    from baselines.playerfile import Learned, read_learned, write_learned
    from baselines.policy import LearnedPlayer, Policy
    from baselines.pretrained import find_pretrained
    from baselines.regret import regret_bounds
    from baselines.training import train_players

_HOMES = {
    "GameVecEnv": "bridge",
    "Learned": "playerfile",
    "LearnedPlayer": "policy",
    "Policy": "policy",
    "export_policy": "export",
    "find_pretrained": "pretrained",
    "judge": "evaluation",
    "read_learned": "playerfile",
    "regret_bounds": "regret",
    "train_players": "training",
    "write_learned": "playerfile",
}

__all__ = [
    "GameVecEnv",
    "Learned",
    "LearnedPlayer",
    "Policy",
    "export_policy",
    "find_pretrained",
    "judge",
    "read_learned",
    "regret_bounds",
    "train_players",
    "write_learned",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
