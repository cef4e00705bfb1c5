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
    """Write the games that ``folder`` lacks and their digests; return the number written."""
    folder.mkdir(parents=True, exist_ok=True)
    digests = read_digests(folder)
    written = 0
    for name, tables in drafts():
        path = folder / name / f"{VERSION}.toml"
        if f"{name}/{path.name}" not in digests:
            path.parent.mkdir(exist_ok=True)
            path.write_text(toml_text(name, tables), encoding="utf-8")
            digests[f"{name}/{path.name}"] = hashlib.sha256(path.read_bytes()).hexdigest()
            written += 1
    lines = [f"{digest}  {name}\n" for name, digest in sorted(digests.items())]
    (folder / DIGESTS).write_text("".join(lines), encoding="utf-8")
    return written


def read_digests(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of every game file as it was first written, by its path."""
    path = folder / DIGESTS
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {name: digest for digest, name in (line.split("  ", 1) for line in lines)}


if __name__ == "__main__":
    write_games(Path(__file__).parents[1] / "games")
