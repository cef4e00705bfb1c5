"""A measured value and its target."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Measurement:
    """The ``value`` of ``what``, with a ``target`` to reach, or not to exceed.

    ``at_least`` says which; a target of zero is none.
    """

    what: str
    value: float
    target: float
    at_least: bool = False

    @property
    def held(self) -> bool:
        """Whether the target is met."""
        return self.value >= self.target if self.at_least else self.value <= self.target
