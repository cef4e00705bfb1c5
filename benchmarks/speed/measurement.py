"""A measured number beside what it should be."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Measurement:
    """``value`` of ``what``, which should be ``at_least`` the target, or else at most.

    A target of zero only reports.
    """

    what: str
    value: float
    target: float
    at_least: bool = False

    @property
    def held(self) -> bool:
        """Whether it is as it should be."""
        return self.value >= self.target if self.at_least else self.value <= self.target
