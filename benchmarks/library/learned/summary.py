"""Rows of tables about learned tracks and their entries."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.library.learned.entries import read_entries
from benchmarks.library.learned.track import SPLITS, Track, tracks

TRACK_HEADS = ("track", "test games", "score 100 is", "best entry", "test score", "beyond")
ENTRY_HEADS = ("track", "player", "test score", "beyond", "trainings", "by", "date")


def track_rows() -> list[tuple[str, ...]]:
    """Return a row per track with its best entry."""
    rows: list[tuple[str, ...]] = []
    for track in tracks():
        _, name, *cells = (*_entry_rows(track)[:1], ("", "", "", ""))[0]
        about = track.about
        games = str(len(about["games"]))
        rows.append((f"`{track.name}`", games, about["reference"], name, *cells[:2]))
    return rows


def entry_rows() -> list[tuple[str, ...]]:
    """Return a row per entry of every track, the best test score of a track first."""
    return [row for track in tracks() for row in _entry_rows(track)]


def _entry_rows(track: Track) -> list[tuple[str, ...]]:
    return [
        (
            f"`{track.name}`",
            entry["player"],
            *(_limits(entry["scores"][split]) for split in SPLITS),
            str(entry["runs"]),
            entry["by"],
            str(entry["provenance"].get("date", "")),
        )
        for entry in read_entries(track)["entries"]
    ]


def _limits(limits: Sequence[float | None]) -> str:
    value, low, high = limits
    return f"{value:.2f}" if low is None else f"{value:.2f} [{low:.2f}, {high:.2f}]"
