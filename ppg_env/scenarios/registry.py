"""The registry of scenarios: every function in this package that returns a ``Course``."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType

from ppg_env.scenarios.course import Course

OTHERS = ("course", "make", "registry")
"""Modules of the package that define no scenarios."""


@dataclass(frozen=True)
class Registry:
    """The scenarios of this package.

    Attributes
    ----------
    functions : every scenario by its name, those of the paper first.
    broken : per module that cannot be used, one sentence with its file and the error.
    """

    functions: dict[str, Callable[..., Course]]
    broken: tuple[str, ...]


def registry() -> dict[str, Callable[..., Course]]:
    """Return every scenario by its name, those of the paper first."""
    return load_registry().functions


@lru_cache(maxsize=1)
def load_registry() -> Registry:
    """Import the modules of this package; a module that fails to import breaks no other."""
    package = importlib.import_module("ppg_env.scenarios")  # ppg_env.scenarios is a function
    names = {info.name for info in pkgutil.iter_modules(package.__path__)}.difference(OTHERS)
    functions: dict[str, Callable[..., Course]] = {}
    broken = []
    for name in sorted(names, key=lambda name: (name != "paper", name)):
        try:
            functions |= _scenarios_of(importlib.import_module(f"{package.__name__}.{name}"))
        except (Exception, SystemExit) as error:  # a broken file is reported, whatever it raises
            problem = " ".join(f"{type(error).__name__}: {error}".split())
            broken.append(f"the scenario file {_path(package, name)} is broken ({problem:.200})")
    return Registry(functions, tuple(broken))


def _scenarios_of(module: ModuleType) -> dict[str, Callable[..., Course]]:
    scenarios: dict[str, Callable[..., Course]] = {
        key: value
        for key, value in vars(module).items()
        if inspect.isfunction(value) and value.__module__ == module.__name__ and key[0] != "_"
    }
    for key, function in scenarios.items():
        try:
            hints = inspect.get_annotations(function, eval_str=True)
        except Exception as error:
            raise TypeError(f"annotations of {key} cannot be evaluated, {error}") from None
        for parameter in inspect.signature(function).parameters:
            if parameter not in hints:
                raise TypeError(f"argument {parameter} of {key} has no annotation")
        if hints.get("return") is not Course:
            raise TypeError(f"{key} is not annotated to return a Course")
    return scenarios


def _path(package: ModuleType, name: str) -> str:
    spec = importlib.util.find_spec(f"{package.__name__}.{name}")
    return str(spec.origin) if spec is not None else name
