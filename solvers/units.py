"""Planners that work in the units of the game (:mod:`ppg_env.game.canonical`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass, replace
from functools import wraps
from typing import Any, TypeVar, cast

from ppg_env.game.canonical import Frame, frame_of
from ppg_env.game.evaluation import evaluate
from ppg_env.game.plan import Plan
from solvers.solution import Solution

Planner = TypeVar("Planner", bound=Callable[..., Any])


def in_units_of_the_game(planner: Planner) -> Planner:
    """Return ``planner``, whose first argument is a game, so that it sees the canonical game.

    Profiles among its arguments, and the solutions that it returns, are converted.
    """

    @wraps(planner)
    def converted(game: Any, *values: Any, **options: Any) -> Any:
        frame = frame_of(game)
        if frame is None:
            return planner(game, *values, **options)
        values = tuple(_into(frame, value) for value in values)
        options = {name: _into(frame, value) for name, value in options.items()}
        return _back(frame, planner(frame.canonical, *values, **options))

    return cast(Planner, converted)


def _into(frame: Frame, value: Any) -> Any:
    profile = isinstance(value, tuple) and value and all(isinstance(p, Plan) for p in value)
    return frame.into(value) if profile and len(value) == len(frame.controls) else value


def _back(frame: Frame, result: Any) -> Any:
    if isinstance(result, list):
        return [_back(frame, item) for item in result]
    if isinstance(result, Solution):
        if result.profile is None:
            return replace(result, game=frame.game)
        profile = frame.back(result.profile)
        return replace(
            result, game=frame.game, profile=profile, evaluation=evaluate(frame.game, profile)
        )
    if is_dataclass(result) and hasattr(result, "solution"):
        return replace(result, solution=_back(frame, result.solution))  # type: ignore[type-var]
    return result
