"""The registry of scenarios: every function in this package that returns a ``Course``."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable
from functools import lru_cache

from ppg_env.scenarios.course import Course

OTHERS = ("course", "make", "registry")
"""Modules of the package that define no scenarios."""


@lru_cache(maxsize=1)
def registry() -> dict[str, Callable[..., Course]]:
    """Return every scenario by its name, those of the paper first."""
    package = importlib.import_module("ppg_env.scenarios")  # ppg_env.scenarios is a function
    found: dict[str, Callable[..., Course]] = {}
    names = sorted(info.name for info in pkgutil.iter_modules(package.__path__))
    for name in sorted(set(names).difference(OTHERS), key=lambda name: (name != "paper", name)):
        module = importlib.import_module(f"{package.__name__}.{name}")
        for key, value in vars(module).items():
            if inspect.isfunction(value) and value.__module__ == module.__name__ and key[0] != "_":
                found[key] = value
    return found
