"""Time limits."""

from __future__ import annotations

from time import monotonic


class Clock:
    """Seconds left of a limit that is shared by several solves; None never runs out."""

    def __init__(self, limit: float | None) -> None:
        self.start, self.limit = monotonic(), limit

    @property
    def spent(self) -> float:
        """Seconds since the clock was made."""
        return monotonic() - self.start

    @property
    def left(self) -> float | None:
        """Seconds that remain, never negative."""
        return None if self.limit is None else max(self.limit - self.spent, 0.0)

    @property
    def out(self) -> bool:
        """Whether the time is up."""
        return self.left is not None and self.left <= 0
