"""Ids of the environments, in Gymnasium's and PettingZoo's registries.

    gymnasium.make("ppg/HeadOn-v0")                  one learner against players of straight plans
    gymnasium.make_vec("ppg/Circle-v0", 64, n=8)     the same, many copies in one simulator
    pettingzoo.make("parallel", "ppg/circle-v0", n=8)
    pettingzoo.make("aec", "ppg/game-v0", game="my_game.toml")

There is an id for every scenario, in the style of each registry, and ``ppg/Game-v0`` or
``ppg/game-v0`` for any game.  Arguments of a family, rules of play and fields of the game are
keyword arguments.  The version rises when a trajectory, a reward or the use of the seed changes.

``import ppg_env`` registers the ids.  Programs that take the name of an environment only, such as
experiment files, import it by ``"ppg_env:ppg/HeadOn-v0"`` (Gymnasium; PettingZoo cannot).
"""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

import numpy as np

from ppg_env.scenarios.registry import registry

if TYPE_CHECKING:
    from gymnasium.vector import VectorEnv

    from ppg_env.env.parallel_env import PathPlanningEnv
    from ppg_env.env.single_agent_env import SingleAgentEnv

VERSION = 0
ANY_GAME = "game"
HOME = "ppg_env.env.registration"


def register_environments() -> None:
    """Register every scenario; releases of PettingZoo without a registry are skipped."""
    for name in (*registry(), ANY_GAME):
        kwargs = {} if name == ANY_GAME else {"game": name}
        _register_with_gymnasium(gymnasium_id(name), kwargs)
        _register_with_pettingzoo(pettingzoo_id(name), kwargs)


def gymnasium_id(name: str) -> str:
    """Return the id of a scenario in Gymnasium's style, such as ``ppg/HeadOn-v0``."""
    words = "".join(word[:1].upper() + word[1:] for word in name.split("_"))
    return f"ppg/{words}-v{VERSION}"


def pettingzoo_id(name: str) -> str:
    """Return the id of a scenario in PettingZoo's style, such as ``ppg/head_on-v0``."""
    return f"ppg/{name}-v{VERSION}"


def _register_with_gymnasium(name: str, kwargs: dict[str, Any]) -> None:
    import gymnasium

    if name not in gymnasium.registry:
        gymnasium.register(
            name,
            entry_point=f"{HOME}:single_agent_env",
            vector_entry_point=f"{HOME}:vector_env",
            kwargs=kwargs,
        )


def _register_with_pettingzoo(name: str, kwargs: dict[str, Any]) -> None:
    try:
        from pettingzoo import aec_registry, parallel_registry, register
    except ImportError:  # before 1.27
        return
    if name not in parallel_registry:
        register("parallel", name, entry_point=f"{HOME}:parallel_env", kwargs=kwargs)
    if name not in aec_registry:
        register("aec", name, entry_point="ppg_env.path_planning_v0:env", kwargs=kwargs)


def parallel_env(game: Any = "opposing", **options: Any) -> PathPlanningEnv:
    """Return the PettingZoo environment of ``game``; options may be arguments of its family."""
    from ppg_env.env.parallel_env import PathPlanningEnv

    return PathPlanningEnv(_with_arguments(game, options), **options)


def single_agent_env(game: Any = "opposing", **options: Any) -> SingleAgentEnv:
    """Return the Gymnasium environment of ``game``, otherwise as :func:`parallel_env`."""
    from ppg_env.env.single_agent_env import SingleAgentEnv

    return SingleAgentEnv(_with_arguments(game, options), **options)


def vector_env(game: Any = "opposing", num_envs: int = 1, **options: Any) -> VectorEnv:
    """Return ``num_envs`` copies as one Gymnasium environment, otherwise as the single one."""
    from ppg_env.env.vector_env import GameVectorEnv

    return GameVectorEnv(_with_arguments(game, options), num_envs, **options)


def _with_arguments(game: Any, options: dict[str, Any]) -> Any:
    """Return the call of a family with its arguments, which are taken out of ``options``."""
    function = registry().get(game) if isinstance(game, str) else None
    if function is None:
        return game
    names = [name for name in inspect.signature(function).parameters if name in options]
    values = {name: options.pop(name) for name in names}
    plain = {key: v.item() if isinstance(v, np.generic) else v for key, v in values.items()}
    return f"{game}({', '.join(f'{key}={v!r}' for key, v in plain.items())})" if plain else game
