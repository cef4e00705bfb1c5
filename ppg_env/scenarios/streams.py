"""Two streams of traffic that cross at right angles."""

from __future__ import annotations

from math import ceil, sqrt

from ppg_env.errors import require
from ppg_env.scenarios.course import Course


def streams(n: int = 6, spacing: float = 30.0) -> Course:
    """N agents in two streams, one eastward and one northward, lane by lane through each other."""
    require(n >= 1, "n", f"is {n}", "ask for at least one agent")
    require(spacing > 0, "spacing", f"is {spacing}", "write a positive number")
    half = -(-n // 2)
    lanes = max(ceil(sqrt(half / 2)), 1)  # twice as deep as wide
    depth = -(-half // lanes)
    width, queue = (lanes - 1) * spacing, depth * spacing
    starts, goals = [], []
    for k in range(n):
        lane, place = (k // 2) % lanes * spacing, (k // 2) // lanes * spacing
        # Every agent crosses the whole field; the queues re-form behind it.
        along, across = -spacing - place, width + queue - place
        east = k % 2 == 0
        starts.append((along, lane) if east else (lane, along))
        goals.append((across, lane) if east else (lane, across))
    longest = ceil((width + queue + spacing) / 10)
    return Course(starts, goals, horizon=longest + max(6, 2 * lanes))
