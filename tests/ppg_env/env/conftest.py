"""Rules in all combinations, and the games they are tried on."""

from __future__ import annotations

from itertools import product
from typing import Any

from ppg_env.env.rules import CHOICES

LIFE_CYCLES: list[dict[str, Any]] = [
    {"arrival": arrival, "on_goal": goal, "on_crash": crash, "sharing": sharing}
    for arrival, goal, crash, sharing in product(
        CHOICES["arrival"], CHOICES["on_goal"], CHOICES["on_crash"], CHOICES["sharing"]
    )
]


def with_schedule(options: dict[str, Any], agents: int, times: int = 6) -> dict[str, Any]:
    """Add the arrival times that ``arrival='schedule'`` needs."""
    if options.get("arrival") != "schedule":
        return options
    return options | {"schedule": tuple(times + i for i in range(agents))}


def name(options: dict[str, Any]) -> str:
    return "-".join(str(value) for value in options.values())
