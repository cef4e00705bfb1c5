"""Rows of tables about players of the library."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benchmarks.terminal import interval, probability
from ppg_env.support.statistics import Interval

if TYPE_CHECKING:
    from benchmarks.library.record import Entry

PLAYER_COLUMNS = (
    "player",
    "sees",
    "expected cost",
    "crash probability",
    "regret",
    "episodes",
    "by",
)


def player_row(name: str, entry: Entry) -> tuple[str, ...]:
    """Return the cells of a player: :data:`PLAYER_COLUMNS`."""
    cost, crash = (Interval(*entry[key]) for key in ("cost", "crash"))
    regret = "; ".join(f"{low:.3f} to {most:.3f}" for low, most in entry.get("regret", ()))
    by = str(entry["provenance"].get("by", ""))
    count = f"{entry['episodes']:,}"
    return (
        name,
        entry["sees"],
        interval(cost, ".3f", ".3f"),
        probability(crash),
        regret,
        count,
        by,
    )
