"""Default paths of output files, in the folder ``out``, which commands create."""

from __future__ import annotations

import re
from pathlib import Path

from ppg_env.support.atomic_write import check_target

FOLDER = Path("out")


def target(name: str, given: str | None, *suffixes: str) -> str:
    """Return the path ``given``, or one in :data:`FOLDER`; checked before any work is done.

    The first of ``suffixes`` is the default.
    """
    if given is None:
        stem = re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-")
        given = str(FOLDER / f"{stem}{suffixes[0]}")
    check_target(given, *suffixes, ours=FOLDER)
    return given


def own_folder(path: str) -> None:
    """Create :data:`FOLDER`, if ``path`` is in it."""
    if Path(path).parent == FOLDER:
        FOLDER.mkdir(exist_ok=True)
