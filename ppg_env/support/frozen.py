"""Frozen records with array fields that compare, hash, copy and pickle by value."""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np


def frozen_array(values: Any) -> np.ndarray:
    """Return a read-only float64 copy; -0.0 becomes 0.0, so that equal values have equal bytes."""
    array = np.array(values, dtype=np.float64) + 0.0
    array.setflags(write=False)
    return array


def _key(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if isinstance(value, tuple):
        return tuple(_key(item) for item in value)
    return value


class Record:
    """Mixin for ``@dataclass(frozen=True, eq=False)``: value semantics over array fields."""

    # The type checker cannot know that every subclass is a dataclass.

    @cached_property
    def _identity(self) -> tuple[Any, ...]:
        return tuple(_key(getattr(self, field.name)) for field in fields(self))  # type: ignore[arg-type]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._identity == other._identity

    @cached_property
    def _hash(self) -> int:
        return hash(self._identity)

    def __hash__(self) -> int:
        return self._hash

    def __reduce__(self) -> tuple[Any, ...]:
        # The constructor validates the copy and makes its arrays read-only.
        return type(self), tuple(getattr(self, field.name) for field in fields(self))  # type: ignore[arg-type]
