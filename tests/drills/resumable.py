"""Commands that continue where they were stopped, short enough to be killed many times."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pytest

from benchmarks.library.instance import FOLDER
from benchmarks.sweeps import Store
from tests.baselines.small import shorten_trainings

WHEN = ("seconds", "date", "machine", "generated")
"""Entries that say when and where something ran."""


def _nothing() -> None:
    pass


@dataclass(frozen=True)
class Job:
    """A command, what its folder holds afterwards, and what the process and the folder need."""

    words: tuple[object, ...]
    result: Callable[[Path], bytes]
    prepare: Callable[[], None] = _nothing
    furnish: Callable[[Path], None] = lambda _folder: None


def timeless(value: Any) -> Any:
    """Return JSON values without what says when and where they were made."""
    if isinstance(value, dict):
        return {key: timeless(item) for key, item in value.items() if key not in WHEN}
    return [timeless(item) for item in value] if isinstance(value, list) else value


def stored(path: Path) -> bytes:
    """Return the rows of a store without their seconds, and check the file."""
    with sqlite3.connect(path) as base:
        assert base.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    with Store(path) as store:
        rows = [timeless(asdict(row)) for row in store.rows()]
    return json.dumps(rows, default=repr).encode()


def _page(folder: Path) -> bytes:
    return stored(folder / "cells.db") + (folder / "report.html").read_bytes()


def _library(folder: Path) -> bytes:
    lines = (folder / "runs.jsonl").read_text("utf-8").splitlines()
    records = sorted((folder / "games").glob("*/*.json"))
    texts = [*sorted(lines), *(path.read_text("utf-8") for path in records)]
    return json.dumps([timeless(json.loads(text)) for text in texts]).encode()


def _shorten() -> None:
    import torch

    import baselines.train  # noqa: F401  # imported before the processes fork

    torch.set_num_threads(1)
    shorten_trainings(pytest.MonkeyPatch())


def _copy_games(folder: Path) -> None:
    """Copy some games of the library, without their records, into ``folder``."""
    for path in sorted(FOLDER.glob("head_on-*/1.toml"))[:40]:
        place = folder / "games" / path.parent.name
        place.mkdir(parents=True)
        shutil.copy(path, place)


LAMS = ",".join(f"{k / 20:g}" for k in range(1, 20))
SWEEP = ("sweep", "head_on", "--speed", "l1", "--set", f"lam={LAMS}", "--players", "straight,nash")
JOBS = {
    "sweep": Job(
        (*SWEEP, "--episodes", 20_000, "--store", "rows.db"), lambda f: stored(f / "rows.db")
    ),
    "training": Job(
        ("train", "intersection", "--speed", "l1", "--steps", 8 * 1024, "--out", "players.npz"),
        lambda f: (f / "players.npz").read_bytes(),
        _shorten,
    ),
    "reproduction": Job(
        ("reproduce", "--scenarios", "parallel", "--settings", "l1:3", "--lams", "0.3,0.8",
         "--episodes", 200, "--store", "cells.db", "--out", "report.html"),
        _page,
    ),
    "library run": Job(
        ("library", "run", "nash", "--games", "games", "--runs", "runs.jsonl", "--submit"),
        _library,
        furnish=_copy_games,
    ),
}  # fmt: skip
