"""The games of the library and their files: ``games/NAME/VERSION.toml``, with records next to them.

A game file never changes; its digest stands in ``games/DIGESTS``.  Wheels do not contain the games:
the library is read from a checkout of the project, or from the folder that is named.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from benchmarks.library.record import Record, read_record
from ppg_env.errors import InputError, require
from ppg_env.formats.game_file import read_game, read_tables
from ppg_env.game.game import Game

FOLDER = Path(__file__).parent / "games"
NAME = re.compile(r"[A-Za-z0-9_.-]+")

CLASSES = ("easy", "hard", "open")
"""Closed within :data:`EASY` seconds, closed with more, and not closed."""

EASY = 1.0
"""CPU seconds of the proof of an easy game's social optimum, on the recorded machine."""


@dataclass(frozen=True)
class Instance:
    """One version of a game.

    Attributes
    ----------
    path : its file.
    """

    path: Path

    @property
    def name(self) -> str:
        """Name and version, such as ``door1.0-walkers2/1``."""
        return f"{self.path.parent.name}/{self.path.stem}"

    @property
    def record_path(self) -> Path:
        """The file of its record."""
        return self.path.with_suffix(".json")

    @cached_property
    def tables(self) -> dict[str, Any]:
        """The tables of its file."""
        return read_tables(self.path)

    @cached_property
    def game(self) -> Game:
        """The game."""
        return read_game(self.path)

    @cached_property
    def record(self) -> Record:
        """The best known plans and bounds; empty for a game without a record."""
        return read_record(self.record_path)

    @property
    def digest(self) -> str:
        """SHA-256 of its file."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest()

    @property
    def difficulty(self) -> str:
        """One of :data:`CLASSES`, by the record."""
        if not self.record.closed:
            return "open"
        return "easy" if self.record.proof_seconds <= EASY else "hard"


def instances(folder: Path = FOLDER) -> list[Instance]:
    """Return the latest version of every game in ``folder``, by name.

    Raises
    ------
    InputError
        If there is no library at ``folder``.
    """
    latest: dict[str, Path] = {}
    for path in folder.glob("*/*.toml"):
        newer = path.stem.isdigit() and NAME.fullmatch(path.parent.name)
        if newer and int(path.stem) > int(getattr(latest.get(path.parent.name), "stem", 0)):
            latest[path.parent.name] = path
    require(
        bool(latest),
        str(folder),
        "has no games of the library, which is not part of the installed package",
        "clone the repository, and run ppg there or name its benchmarks/library/games with --games",
    )
    return [Instance(latest[name]) for name in sorted(latest)]


def chosen(
    names: Sequence[str] = (), *, kind: str | None = None, folder: Path = FOLDER
) -> list[Instance]:
    """Return the games that ``names`` match (``*`` for any text), of the class ``kind``.

    Raises
    ------
    InputError
        If a name matches no game, or there is no such class.
    """
    require(
        kind is None or kind in CLASSES, "--class", f"is {kind!r}", "write " + ", ".join(CLASSES)
    )
    every = instances(folder)
    selected = every if not names else [one for text in names for one in _matching(text, every)]
    unique = {instance.name: instance for instance in selected}
    return [one for one in unique.values() if kind is None or one.difficulty == kind]


def _matching(text: str, every: Sequence[Instance]) -> list[Instance]:
    pattern = re.compile(".*".join(map(re.escape, text.split("*"))))
    matching = [
        instance
        for instance in every
        if pattern.fullmatch(instance.name) or pattern.fullmatch(instance.path.parent.name)
    ]
    if matching:
        return matching
    from ppg_env.formats.keys import nearest

    names = [instance.path.parent.name for instance in every]
    raise InputError(f"{text!r:.80}", "is not a game of the library", nearest(text, names))
