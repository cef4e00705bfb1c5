"""Grids of cells: every combination of games, values of their fields, players and seeds.

A grid is written on the command line, or as a file with the same names:

    [sweep]
    games = ["head_on", "circle(4)"]
    players = ["nash", "social"]
    seeds = "0:5"                      # or a list
    episodes = 10_000
    [set]                              # fields of the game, a list of values each
    lam = [0.1, 0.5, [0.2, 0.8]]       # a list among them has one number per agent
    speed = ["l1", "disc"]
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

from benchmarks.comparison.players import FILE, chosen_players, find_player
from benchmarks.sweeps.cell import SELFISH, Cell
from ppg_env.errors import InputError, placed, require
from ppg_env.formats.game_file import read_tables

MOST = 100_000
"""Most seeds of a sweep."""


@dataclass(frozen=True)
class Grid:
    """Values to combine; the names are those of :class:`Cell`, in the plural for several values.

    ``starts``, ``orders`` and ``charges`` are combined for the players that accept them.  The
    default arena is the environment if a player needs it, and else the schedule.
    """

    games: tuple[str, ...]
    values: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    players: tuple[str, ...] = ("nash", "potential", "social", "straight")
    starts: tuple[str | None, ...] = (None,)
    orders: tuple[str | tuple[int, ...], ...] = ("cyclic",)
    charges: tuple[str, ...] = (SELFISH,)
    seeds: tuple[int, ...] = (0,)
    arena: str | None = None
    episodes: int = 10_000
    groups: int = 1
    deviation: str | None = None
    solver: str = "ENGINE"
    time_limit: float | None = None
    node_limit: int | None = None

    def cells(self) -> list[Cell]:
        """Return all combinations; games vary slowest, then fields, players and, fastest, seeds."""
        players, arena = chosen_players(",".join(self.players), self.arena)
        return [
            Cell(
                game,
                player,
                dict(zip(self.values, chosen, strict=True)),
                arena,
                self.episodes,
                self.groups,
                self.deviation,
                solver=self.solver,
                time_limit=self.time_limit,
                node_limit=self.node_limit,
                seed=seed,
                start=start,
                order=order,
                charge=charge,
            )
            for game in self.games
            for chosen in product(*self.values.values())
            for player in players
            for start, order, charge in self._dynamics(player)
            for seed in self.seeds
        ]

    def _dynamics(self, player: str) -> list[tuple[str | None, str | tuple[int, ...], str]]:
        accepted = find_player(player).accepts
        if "order" not in accepted:
            return [(None, "cyclic", SELFISH)]
        charges = self.charges if "charge" in accepted else (SELFISH,)
        return list(product(self.starts, self.orders, charges))


def is_grid(path: str) -> bool:
    """Return whether the .toml file at ``path`` describes a sweep, not a game."""
    return path.endswith(".toml") and "sweep" in read_tables(path)


def read_grid(path: str | Path) -> Grid:
    """Return the grid in a TOML file; paths of games and players are relative to its folder.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, or does not describe a grid.
    """
    tables, folder = read_tables(path), Path(path).parent
    with placed(str(path), ": "):
        _known(tables, ("sweep", "set"), "the file")
        words, values = (_table(tables, name) for name in ("sweep", "set"))
        _known(words, tuple(READERS), "[sweep]")
        require("games" in words, "sweep.games", "is missing", "list scenarios or game files")
        for key in values:
            with placed("set"):
                _list(key, values[key])
        read = {}
        for key, value in words.items():
            with placed("sweep"):
                read[key] = READERS[key](key, value)
        for key, suffix in (("games", ".toml"), ("players", FILE)):
            given = read.get(key, ())
            read |= {key: tuple(str(folder / f) if f.endswith(suffix) else f for f in given)}
        return Grid(values=values, **{key: value for key, value in read.items() if value != ()})


def field_values(text: str) -> tuple[str, list[Any]]:
    """Return name and values of ``lam=0.1,0.5``, ``speed=l1,disc`` or ``lam=[0.2,0.8],0.5``."""
    name, sign, listed = (part.strip() for part in text.partition("="))
    try:
        values = tomllib.loads(f"values = [{listed}]")["values"]
    except tomllib.TOMLDecodeError:  # words need no quotes on the command line
        values = [part.strip() for part in listed.split(",")]
    require(
        bool(name and sign and listed and values),
        "--set",
        f"is {text!r}",
        "write FIELD=VALUE,VALUE,... such as lam=0.1,0.5",
    )
    return name, values


def whole_numbers(name: str, text: Any) -> tuple[int, ...]:
    """Return the numbers in ``0:5`` (0 to 4) or ``1,4``, or those of a list."""
    try:
        if isinstance(text, str) and ":" in text:
            first, last = text.split(":")
            numbers = tuple(range(int(first or 0), min(int(last), int(first or 0) + MOST + 1)))
        else:
            parts = text.split(",") if isinstance(text, str) else text
            numbers = tuple(int(part) for part in parts)
            if any(isinstance(part, (bool, float)) for part in parts):
                raise ValueError
    except (TypeError, ValueError):
        numbers = ()
    shown = f"is {text!r:.80}"
    require(bool(numbers), name, shown, "write 0:5 for 0 to 4, or list whole numbers")
    require(len(numbers) <= MOST, name, shown, f"give at most {MOST:,} numbers")
    require(max(map(abs, numbers)) < 2**63, name, shown, "write smaller numbers")
    return numbers


def _words(key: str, value: Any) -> tuple[str, ...]:
    words = tuple(_list(key, value))
    fits = all(isinstance(item, str) for item in words)
    require(fits, key, f"is {value!r:.60}", 'write words in quotes, as in ["nash", "social"]')
    return words


def _orders(key: str, value: Any) -> tuple[str | tuple[int, ...], ...]:
    return tuple(
        item if isinstance(item, str) else whole_numbers(key, item) for item in _list(key, value)
    )


def _word(key: str, value: Any) -> str:
    require(isinstance(value, str), key, f"is {value!r:.60}", "write one word in quotes")
    return str(value)


def _whole(key: str, value: Any) -> int:
    whole = isinstance(value, int) and not isinstance(value, bool)
    require(whole, key, f"is {value!r:.60}", "write a whole number")
    return int(value)


def _seconds(key: str, value: Any) -> float:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    require(number and value >= 0, key, f"is {value!r:.60}", "write a number of seconds")
    return float(value)


READERS: dict[str, Callable[[str, Any], Any]] = {
    "games": _words,
    "players": _words,
    "starts": _words,
    "orders": _orders,
    "charges": _words,
    "seeds": whole_numbers,
    "arena": _word,
    "episodes": _whole,
    "groups": _whole,
    "deviation": _word,
    "solver": _word,
    "time_limit": _seconds,
    "node_limit": _whole,
}
"""The function that reads each key of [sweep]."""


def _list(key: str, value: Any) -> list[Any]:
    filled = isinstance(value, list) and bool(value)
    require(filled, key, f"is {value!r:.60}", "write a list of values in [ ]")
    return list(value)


def _table(tables: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    table = tables.get(name, {})
    require(isinstance(table, Mapping), name, "is not a table", f"write it as [{name}]")
    return table


def _known(table: Mapping[str, Any], keys: Sequence[str], what: str) -> None:
    for key in sorted(set(table) - set(keys)):
        raise InputError(key, f"is not a key of {what}", "use one of " + ", ".join(keys))
