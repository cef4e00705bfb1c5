"""The drill ``hostile``: commands on files made to hurt."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests.drills.command import ppg
from tests.drills.figures import Figure, wanted
from tests.drills.hostile_archives import ARCHIVES
from tests.drills.hostile_files import CASES


def drill(_size: float) -> Iterator[Figure]:
    """Run a command on each hostile file."""
    with tempfile.TemporaryDirectory() as name:
        for k, (what, make) in enumerate((CASES | ARCHIVES).items()):
            if not wanted(what):
                continue
            folder = Path(name) / str(k)
            folder.mkdir()
            words = make(folder)
            ended = ppg(*words, folder=folder)
            wrong = ended.refused()
            failures = [wrong] if wrong else []
            failures += ["it was executed"] * (folder / "executed").exists()
            failures += ["it wrote outside"] * (Path(name) / "outside").exists()
            failures += ["control characters"] * ("\x1b" in ended.out + ended.err)
            yield Figure(
                what,
                f"`ppg {words[0]}`",
                f"{ended.seconds:.1f} CPU s, {ended.mebibytes:.0f} MiB",
                tuple(failures),
            )
