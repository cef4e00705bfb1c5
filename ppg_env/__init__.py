"""Path planning games: the game as data, its evaluator, its simulation."""

from __future__ import annotations

from ppg_env.errors import InputError
from ppg_env.evaluate import Evaluation, evaluate
from ppg_env.game import Agent, Game, SpectralRadiusWarning
from ppg_env.make import make_game, scenarios
from ppg_env.plan import Plan, Profile, make_plan, make_profile, straight_plan
from ppg_env.polytope import Polytope

__all__ = [
    "Agent",
    "Evaluation",
    "Game",
    "InputError",
    "Plan",
    "Polytope",
    "Profile",
    "SpectralRadiusWarning",
    "evaluate",
    "make_game",
    "make_plan",
    "make_profile",
    "scenarios",
    "straight_plan",
]
