"""Marks for parametrised tests: a few cases guard a change, the others are slow."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def first(count: int, values: Iterable[Any]) -> list[Any]:
    """The first ``count`` values as they are, the others marked as slow."""
    return [_marked(value, k >= count) for k, value in enumerate(values)]


def slow_if(costly: Callable[[Any], bool], values: Iterable[Any]) -> list[Any]:
    """The values, the costly ones marked as slow."""
    return [_marked(value, costly(value)) for value in values]


def _marked(value: Any, slow: bool) -> Any:
    return pytest.param(value, marks=pytest.mark.slow) if slow else value
