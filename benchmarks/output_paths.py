"""Where commands write what nobody gave a place: the folder ``out``, which is theirs to make."""

from __future__ import annotations

import re
from pathlib import Path

from ppg_env.support.atomic_write import check_target

FOLDER = Path("out")


def target(name: str, suffix: str, given: str | None) -> str:
    """The path ``given``, or one in :data:`FOLDER`; checked before any work is done for it."""
    if given is None:
        stem = re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-")
        given = str(FOLDER / f"{stem}{suffix}")
    check_target(given, suffix, ours=FOLDER)
    return given


def own_folder(path: str) -> None:
    """Make :data:`FOLDER`, if ``path`` is in it."""
    if Path(path).parent == FOLDER:
        FOLDER.mkdir(exist_ok=True)
