"""A budget of time and of linear programs, shared by several solves."""

from __future__ import annotations

from time import monotonic


class Budget:
    """Limits on seconds and nodes that several solves share; None is no limit.

    Seconds depend on the machine.  Nodes, the linear programs of the engine, do not: with a limit
    on nodes alone, the same call gives the same result on every machine.
    """

    def __init__(self, limit: float | None, nodes: int | None = None) -> None:
        self.start, self.limit = monotonic(), limit
        self.nodes, self.used = nodes, 0

    @property
    def spent(self) -> float:
        """Seconds since the budget was made."""
        return monotonic() - self.start

    @property
    def left(self) -> float | None:
        """Seconds that remain, never negative."""
        return None if self.limit is None else max(self.limit - self.spent, 0.0)

    @property
    def late(self) -> bool:
        """Whether the time is used up."""
        return self.left is not None and self.left <= 0

    @property
    def out(self) -> bool:
        """Whether the time or the nodes are used up."""
        return self.late or (self.nodes is not None and self.used >= self.nodes)

    @property
    def time_used(self) -> float:
        """Part of the time limit that is used up, 0 to 1; 0 without one."""
        return 0.0 if self.limit is None else self.spent / max(self.limit, self.spent, 1e-9)

    @property
    def fraction_used(self) -> float:
        """Part of the limits that is used up, 0 to 1; 0 without limits."""
        time = self.time_used
        work = 0.0 if not self.nodes else min(self.used / self.nodes, 1.0)
        return max(time, work)

    def child(self, nodes: int | None) -> Budget:
        """Return a budget for one of several solves: the remaining time, and at most ``nodes``.

        What the child uses counts here after :meth:`charge`.
        """
        if self.nodes is not None:
            rest = max(self.nodes - self.used, 0)
            nodes = rest if nodes is None else min(nodes, rest)
        return Budget(self.left, nodes)

    def charge(self, child: Budget) -> None:
        """Count the nodes that ``child`` has used."""
        self.used += child.used

    def tick(self) -> None:
        """Count one linear program."""
        self.used += 1
