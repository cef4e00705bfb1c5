"""Fill the outputs in the README and the docs with the output of the commands next to them.

A comment ``<!-- output of: ppg ... -->`` before a fenced block names the command.  Run this file
from the root of the project to update all blocks:

    python docs/outputs.py README.md docs/*.md

Pictures named by ``--out NAME.png`` are written to ``docs/``.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import sys
from pathlib import Path

BLOCK = re.compile(r"(<!-- output of: (?P<command>.*?) -->\n```text\n)(?P<output>.*?)(```)", re.S)


def output(command: str) -> str:
    """Return what ``command`` prints on stdout, without trailing blanks."""
    from benchmarks.cli import main

    stream = io.StringIO()
    with contextlib.redirect_stdout(stream), contextlib.suppress(SystemExit):
        main(shlex.split(command)[1:])
    lines = [line.rstrip() for line in stream.getvalue().splitlines()]
    return "\n".join(lines).strip("\n") + "\n"


def filled(text: str) -> str:
    """Return ``text`` with every output block updated."""
    return BLOCK.sub(lambda block: block[1] + output(block["command"]) + block[4], text)


if __name__ == "__main__":
    pages = [Path(name).resolve() for name in sys.argv[1:]]
    os.chdir("docs")
    for page in pages:
        page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8")
