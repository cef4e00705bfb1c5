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
        conversion = _Conversion(frame)
        values = tuple(map(conversion.into, values))
        options = {name: conversion.into(value) for name, value in options.items()}
        return conversion.back(planner(frame.canonical, *values, **options))

    return cast(Planner, converted)


class _Conversion:
    """Converts the arguments and results of one call; plans that are kept stay the same."""

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._given: dict[Plan, Plan] = {}

    def into(self, value: Any) -> Any:
        """Return a profile as one of the canonical game; any other value as it is."""
        if not isinstance(value, (list, tuple)) or not value:
            return value
        if not all(isinstance(plan, Plan) for plan in value):
            return value
        if len(value) != len(self._frame.controls):  # the planner refuses it
            return value
        profile = self._frame.into(tuple(value))
        self._given |= dict(zip(profile, value, strict=True))
        return profile

    def back(self, result: Any) -> Any:
        """Return a solution, or a list of results with solutions, in the user's units."""
        if isinstance(result, list):
            return [self.back(item) for item in result]
        if isinstance(result, Solution):
            return self._solution(result)
        if is_dataclass(result) and hasattr(result, "solution"):
            # The type checker cannot know that a result with a solution is an instance, no class.
            return replace(result, solution=self.back(result.solution))  # type: ignore[type-var]
        return result

    def _solution(self, result: Solution) -> Solution:
        game = self._frame.game
        if result.profile is None:
            return replace(result, game=game)
        pairs = zip(result.profile, self._frame.back(result.profile), strict=True)
        profile = tuple(self._given.get(plan, own) for plan, own in pairs)
        evaluation = evaluate(game, profile, as_given=True)
        return replace(result, game=game, profile=profile, evaluation=evaluation)
