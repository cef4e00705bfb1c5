"""Write the game files of all families: ``python -m benchmarks.library.families.generate``.

A version that exists is never written again: a changed game is a new version, and its generator
says which.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

from benchmarks.library.families import (
    crowds,
    mazes,
    paper,
    roads,
    rooms,
    space,
    variety,
    warehouses,
)
from benchmarks.library.families.tables import Draft
from benchmarks.library.families.toml_text import toml_text

FAMILIES = (paper, crowds, rooms, roads, mazes, warehouses, space, variety)
VERSION = 1
DIGESTS = "DIGESTS"


def drafts() -> Iterator[Draft]:
    """Yield the games of all families, in their order."""
    for family in FAMILIES:
        yield from family.games()


def write_games(folder: Path) -> int:
    """Write the games that ``folder`` lacks and the digests of all; return the number written."""
    written = 0
    for name, tables in drafts():
        path = folder / name / f"{VERSION}.toml"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(toml_text(name, tables), encoding="utf-8")
            written += 1
    files = sorted(folder.glob("*/*.toml"))
    (folder / DIGESTS).write_text("".join(map(_digest_line, files)), encoding="utf-8")
    return written


def _digest_line(path: Path) -> str:
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return f"{digest}  {path.parent.name}/{path.name}\n"


if __name__ == "__main__":
    write_games(Path(__file__).parents[1] / "games")
