"""Scenarios: named courses, each a function in a module of this package.

A module's public functions that return a :class:`Course` are its scenarios; nothing else has to
be touched to add one.  A course says who starts where, bound for where, among which obstacles;
:func:`ppg_env.make_game` gives it the default body, speed, noise and weights of the paper.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable
from functools import lru_cache

from ppg_env.scenarios.course import Course

__all__ = ["Course", "registry"]


@lru_cache(maxsize=1)
def registry() -> dict[str, Callable[..., Course]]:
    """Every scenario by its name, those of the paper first."""
    found: dict[str, Callable[..., Course]] = {}
    modules = sorted(info.name for info in pkgutil.iter_modules(__path__) if info.name != "course")
    for name in sorted(modules, key=lambda name: name != "paper"):
        module = importlib.import_module(f"{__name__}.{name}")
        for key, value in vars(module).items():
            if inspect.isfunction(value) and value.__module__ == module.__name__ and key[0] != "_":
                found[key] = value
    return found
