"""Robustness drills: ``python -m tests.drills [--size SIZE] [NAME ...]``; ``make drills``.

Each drill runs in a process of its own, since it limits its memory and watches what is executed.
The figures are printed, and stored in docs/drills.json, from which docs/drills.md is written.  The
exit code is 1 if a figure has failures.
"""

from __future__ import annotations

import argparse
import importlib
import os
import subprocess
import sys

from tests.drills.figures import PART, Drill, Figure, save
from tests.drills.page import write_page

DRILLS = (
    "files",
    "hostile",
    "faults",
    "kills",
    "disks",
    "clusters",
    "soak",
    "mutation",
)


def main() -> int:
    """Run the drills that are named, all by default."""
    parser = argparse.ArgumentParser(prog="python -m tests.drills", description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*DRILLS, []], metavar="NAME")
    parser.add_argument("--part", help="only figures of a drill whose names contain this")
    parser.add_argument("--size", type=float, default=1.0, help="1 for a night, 0.05 for minutes")
    options = parser.parse_args()
    names = options.names or DRILLS
    if len(names) == 1:
        return run(names[0], options.size, options.part)
    words = (sys.executable, "-m", "tests.drills", "--size", str(options.size))
    codes = [subprocess.run([*words, name], check=False).returncode for name in names]
    return int(any(codes))


def run(name: str, size: float, part: str | None) -> int:
    """Run one drill, print and store its figures; return the exit code."""
    os.environ[PART] = part or ""
    drill: Drill = importlib.import_module(f"tests.drills.{name}").drill
    figures: list[Figure] = []
    stored = 0.0
    for figure in drill(size):
        figures.append(figure)
        mark = "ok    " if figure.passed else "FAILED"
        print(f"{mark} {name}: {figure.what}: {figure.tried}; {figure.result}", flush=True)
        for failure in figure.failures[:20]:
            print(f"       {failure}", flush=True)
        stored = _store(name, size, stored, figures, add=part is not None)
    _store(name, size, stored, figures, add=part is not None)  # with the time of what has ended now
    return int(not all(figure.passed for figure in figures))


def _store(name: str, size: float, stored: float, figures: list[Figure], *, add: bool) -> float:
    """Store the figures at once, since a drill may be ended from outside; return CPU seconds."""
    spent = os.times()
    seconds = spent.user + spent.system + spent.children_user + spent.children_system
    save(name, size, seconds - (stored if add else 0.0), figures, add=add)
    write_page()
    return seconds


if __name__ == "__main__":
    sys.exit(main())
