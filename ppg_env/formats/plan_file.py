"""Plan files: JSON that contains its game, so that a file can be evaluated and replayed alone.

A plan file is the output of ``ppg solve --json`` with ``format``, ``version`` and ``game`` added.
Only the game and the controls are read back; the evaluator recomputes every other number.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ppg_env.errors import InputError, placed, require
from ppg_env.formats.game_file import game_from_tables, game_to_tables
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile, make_profile
from ppg_env.support.atomic_write import write_atomically
from ppg_env.support.read_file import read_text

FORMAT = "path-planning-games/plan"
VERSION = 1


def write_plan(path: str | Path, game: Game, profile: Profile, report: Mapping[str, Any]) -> Path:
    """Write ``profile`` and its game to ``path``; ``report`` holds further entries to store."""
    content = {
        "format": FORMAT,
        "version": VERSION,
        **report,
        "game": game_to_tables(game),
        "controls": [plan.controls.tolist() for plan in profile],
    }
    return write_atomically(path, to_json(content) + "\n")


def read_plan(path: str | Path) -> tuple[Game, Profile, dict[str, Any]]:
    """Return the game, the profile and the other entries (unchecked) of a plan file.

    Raises
    ------
    InputError
        If the file is missing, is not a plan file, or its game or controls are not valid.
    """
    source = str(path)
    text = read_text(path)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            source, f"cannot be read as JSON ({error})", "give a file that ppg solve --out wrote"
        ) from None
    plan_file = isinstance(content, dict) and content.get("format") == FORMAT
    require(plan_file, source, "is not a plan file", "give a file that ppg solve --out wrote")
    require(
        content.get("version") == VERSION,
        source,
        f"has version {content.get('version')!r:.40}",
        f"write it again with this release, which reads version {VERSION}",
    )
    for key, kind in (("game", dict), ("controls", list)):
        require(
            isinstance(content.get(key), kind),
            source,
            f"has no {key}",
            "write it again with ppg solve --out",
        )
    game = game_from_tables(content.pop("game"), source)
    with placed(source, ": "):
        return game, make_profile(game, content.pop("controls")), content


def to_json(value: Any) -> str:
    """Return ``value`` as JSON text; infinite and undefined numbers become null."""
    return json.dumps(_plain(value), allow_nan=False, indent=None)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value
