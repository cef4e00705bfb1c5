"""Path planning games: the game as data, its evaluator, its simulation, its environment.

The environment's names are loaded when first used, since they bring Gymnasium along.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ppg_env.env.registration import register_environments
from ppg_env.errors import InputError
from ppg_env.game.evaluation import Evaluation, evaluate
from ppg_env.game.game import Agent, Game, SpectralRadiusWarning
from ppg_env.game.plan import Plan, Profile, make_plan, make_profile, straight_plan
from ppg_env.game.polytope import Polytope
from ppg_env.scenarios.make import make_game, scenarios

if TYPE_CHECKING:
    from ppg_env.env.parallel_env import PathPlanningEnv
    from ppg_env.env.simulator import Simulator
    from ppg_env.env.single_agent_env import SingleAgentEnv
    from ppg_env.path_planning_v0 import parallel_env

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
    "PathPlanningEnv": "ppg_env.env.parallel_env",
    "Simulator": "ppg_env.env.simulator",
    "SingleAgentEnv": "ppg_env.env.single_agent_env",
    "parallel_env": "ppg_env.path_planning_v0",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


register_environments()
