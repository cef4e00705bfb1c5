"""Status codes of agents in the simulator."""

from __future__ import annotations

TRAFFIC, ARRIVED, CRASHED = 0, 1, 2
"""Where an agent stands: on its way, arrived (gone or parked), or out after a crash."""
