"""Tracks for learners and their files.

    tracks/NAME/game.toml        the game of which all others are draws
    tracks/NAME/train.toml       what training episodes draw: the rule of ``ppg train --randomize``
    tracks/NAME/test.toml        the rule of the test games: new draws of the same kind
    tracks/NAME/beyond.toml      the rule of harder test games, outside the training rule
    tracks/NAME/games.json       the test games of both splits, with the costs of straight flight
                                 and of the reference player
    tracks/NAME/entries.json     the entries of learners, with their history

Rules of a track draw the same fields, so observations have one layout.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from benchmarks.library.learned.drawn_game import DrawnGame
from ppg_env.env.randomize import Randomize
from ppg_env.env.rule_tables import read_randomize
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator
from ppg_env.errors import InputError, require
from ppg_env.formats.game_file import read_game
from ppg_env.game.game import Game

FOLDER = Path(__file__).parents[1] / "tracks"

SPLITS = ("test", "beyond")
"""Splits with test games."""


@dataclass(frozen=True)
class Track:
    """A track.

    Attributes
    ----------
    folder : of its files.
    """

    folder: Path

    @property
    def name(self) -> str:
        """Name of the track."""
        return self.folder.name

    @cached_property
    def game(self) -> Game:
        """The game of which the others are draws."""
        return read_game(self.folder / "game.toml")

    @cached_property
    def about(self) -> dict[str, Any]:
        """The content of ``games.json``."""
        content: dict[str, Any] = json.loads((self.folder / "games.json").read_text())
        return content

    def rule(self, split: str) -> Randomize:
        """Return the rule of ``train`` or of one of :data:`SPLITS`."""
        return read_randomize(self.folder / f"{split}.toml")

    def games(self, split: str) -> list[DrawnGame]:
        """Return the test games of a split."""
        return [DrawnGame(**row) for row in self.about["games"] if row["split"] == split]

    def drawn(self, test: DrawnGame) -> Game:
        """Return the game that episodes of a test game play."""
        simulator = Simulator(self.game, Rules(), 1, 0, test.rule(self.rule("train")))
        simulator.reset()
        return simulator.game_of(0)


def tracks(folder: Path = FOLDER) -> list[Track]:
    """Return the tracks in ``folder``, by name."""
    return [Track(path.parent) for path in sorted(folder.glob("*/games.json"))]


def find_track(name: str, folder: Path = FOLDER) -> Track:
    """Return the track called ``name``.

    Raises
    ------
    InputError
        If there is none.
    """
    known = {track.name: track for track in tracks(folder)}
    require(
        bool(known),
        str(folder),
        "has no tracks, which are not part of the installed package",
        "clone the repository, and run ppg there",
    )
    if name not in known:
        raise InputError(f"{name!r:.80}", "is not a track", "write " + ", ".join(known))
    return known[name]
