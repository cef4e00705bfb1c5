"""What a drill has measured, and the file that keeps it: docs/drills.json."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
STORED = ROOT / "docs" / "drills.json"

PART = "DRILL_PART"
"""Variable with a text: only figures whose names contain it are wanted."""

SHOWN = 5
"""Failures that are kept of each figure."""


@dataclass(frozen=True)
class Figure:
    """One row of a drill.

    Attributes
    ----------
    what : what was tried.
    tried : how many times, or how much.
    result : what happened.
    failures : what was not as it must be; empty if the drill passed.
    """

    what: str
    tried: str
    result: str
    failures: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether all was as it must be."""
        return not self.failures


Drill = Callable[[float], Iterator[Figure]]
"""Takes the size, 1 for a night, and yields figures."""


def wanted(what: str) -> bool:
    """Return whether a figure is to be made."""
    return os.environ.get(PART, "") in what


def load() -> dict[str, Any]:
    """Return the stored results by the names of drills."""
    return json.loads(STORED.read_text(encoding="utf-8")) if STORED.exists() else {}


def save(
    name: str, size: float, seconds: float, figures: list[Figure], *, add: bool = False
) -> None:
    """Store the figures of one drill, in place of all earlier ones or of those of equal names."""
    kept = [asdict(figure) | {"failures": list(figure.failures[:SHOWN])} for figure in figures]
    stored = load()
    if add and name in stored:
        new, earlier = {figure.what for figure in figures}, stored[name]
        kept = [old for old in earlier["figures"] if old["what"] not in new] + kept
        seconds += earlier["cpu_seconds"]
    stored |= {name: {"size": size, "cpu_seconds": round(seconds), "figures": kept}}
    text = json.dumps(dict(sorted(stored.items())), indent=1, ensure_ascii=False)
    STORED.write_text(text + "\n", encoding="utf-8")
