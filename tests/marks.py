"""Marks for parametrised tests: a few cases guard a change, the others are slow."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def first(count: int, values: Iterable[Any]) -> list[Any]:
    """The first ``count`` values as they are, the others marked as slow."""
    return [_marked(value, k >= count) for k, value in enumerate(values)]


def slow_if(
    costly: Callable[[Any], bool],
    values: Iterable[Any],
    nightly: Callable[[Any], bool] = lambda _value: False,
) -> list[Any]:
    """The values, the costly ones marked as slow, and some of them as nightly."""
    return [_marked(value, costly(value), nightly(value)) for value in values]


def _marked(value: Any, slow: bool, nightly: bool = False) -> Any:
    marks = [pytest.mark.slow] * slow + [pytest.mark.nightly] * nightly
    return pytest.param(value, marks=marks) if marks else value
