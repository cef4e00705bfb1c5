"""Where means pass through something between two time steps, for people and for ``--json``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ppg_env.game.between_steps import overlaps_between_steps
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile

MOST_NAMES = 3
"""Most further plans that a note on overlaps between steps names."""


def between_steps_report(game: Game, profile: Profile) -> list[dict[str, Any]]:
    """Return where the means pass through something between two time steps, deepest first."""
    keys = ("agents", "obstacle", "step", "moment", "depth", "place")
    overlaps = overlaps_between_steps(game, profile)
    return [{key: getattr(overlap, key) for key in keys} for overlap in overlaps]


def between_steps_note(game: Game, plans: Mapping[str, Profile | None]) -> str:
    """Return one line on the deepest overlap of means between time steps, empty if there is none.

    ``plans`` are named profiles of which the note names those that overlap; a single plan may have
    an empty name.  With ``collisions="swept"`` such overlaps are violations, so nothing is said.
    """
    if game.collisions == "swept":
        return ""
    overlaps = {
        name: found
        for name, profile in plans.items()
        if profile is not None and (found := overlaps_between_steps(game, profile))
    }
    if not overlaps:
        return ""
    worst = max(overlaps, key=lambda name: overlaps[name][0].depth)
    others = _others(len(overlaps[worst]) - 1, [name for name in overlaps if name != worst])
    return (
        f"{worst}{': ' * bool(worst)}{overlaps[worst][0]}{others}; this game looks at the time "
        "steps only: plan with --collisions swept"
    )


def _others(places: int, names: Sequence[str]) -> str:
    """Return in brackets how many more places one plan has, and which other plans have some."""
    parts = []
    if places:
        parts.append(f"and {places} other place{'s' * (places > 1)}")
    if names:
        few = len(names) <= MOST_NAMES
        parts.append("also " + (", ".join(names) if few else f"{len(names)} other plans"))
    return f" ({'; '.join(parts)})" if parts else ""
