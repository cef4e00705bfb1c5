"""Path planning games: the game as data, its evaluator, its simulation, its environment.

The environment's names are loaded when first used, since they bring Gymnasium along.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ppg_env.errors import InputError
from ppg_env.evaluate import Evaluation, evaluate
from ppg_env.game import Agent, Game, SpectralRadiusWarning
from ppg_env.make import make_game, scenarios
from ppg_env.plan import Plan, Profile, make_plan, make_profile, straight_plan
from ppg_env.polytope import Polytope
from ppg_env.registration import register_environments

if TYPE_CHECKING:
    from ppg_env.parallel import PathPlanningEnv
    from ppg_env.path_planning_v0 import parallel_env
    from ppg_env.simulator import Simulator
    from ppg_env.single import SingleAgentEnv

__all__ = [
    "Agent",
    "Evaluation",
    "Game",
    "InputError",
    "PathPlanningEnv",
    "Plan",
    "Polytope",
    "Profile",
    "Simulator",
    "SingleAgentEnv",
    "SpectralRadiusWarning",
    "evaluate",
    "make_game",
    "make_plan",
    "make_profile",
    "parallel_env",
    "register_environments",
    "scenarios",
    "straight_plan",
]

_HOMES = {
    "PathPlanningEnv": "ppg_env.parallel",
    "Simulator": "ppg_env.simulator",
    "SingleAgentEnv": "ppg_env.single",
    "parallel_env": "ppg_env.path_planning_v0",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


register_environments()
