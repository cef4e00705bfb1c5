"""Run each example in an environment of its own, and print one table: ``make neighbours``.

    python examples/run_neighbours.py [--only rllib] [--steps 50000] [--part train|games]

Each example trains, and then makes a short run in each of five scenarios (``task.py``).
``examples/NAME.txt`` pins what ``examples/NAME.py`` needs; it is installed in ``.neighbours/NAME``
together with this project.  The table gives the reason where an example cannot be installed or run;
``.neighbours/NAME.log`` has the whole output.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import venv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
EXAMPLES, HOME = ROOT / "examples", ROOT / ".neighbours"

GAMES = ("head_on", "intersection", "intersection3", "circle(4)", "corridor")
"""The scenarios of the short runs."""

SHORT = "4000"
"""The steps of a short run."""

HOURS = 1.0
"""How long one installation or one training may take."""


class StoppedError(Exception):
    """A command failed; the argument is its last line."""


def main() -> None:
    """Run the chosen examples; exit with 1 if one of them failed."""
    parser = argparse.ArgumentParser(description="Run examples, each in its own environment.")
    parser.add_argument("--only", default="", help="how the names of examples start")
    parser.add_argument("--steps", default="", help="steps of training; by default its own")
    parser.add_argument("--part", default="", choices=["", "train", "games"], help="one of both")
    options = parser.parse_args()
    names = examples(options.only)
    if not names:
        known = ", ".join(examples())
        parser.error(f"--only is {options.only!r}: use the start of one of {known}")
    HOME.mkdir(exist_ok=True)
    rows: list[str] = []
    stopped = False
    for name in names:
        print(f"{name}: log in .neighbours/{name}.log", file=sys.stderr, flush=True)
        (HOME / f"{name}.log").write_text("", encoding="utf-8")
        for arguments in runs(options.part, options.steps):
            try:
                new = table(run(name, arguments))
            except StoppedError as error:
                new, stopped = [f"{' '.join([name, *arguments])}: {error}"], True
            rows += [row for row in new if row not in rows]  # the title and ppo-selfish come again
    print("\n".join(rows))
    sys.exit(stopped)


def examples(start: str = "") -> list[str]:
    """Return the names of the examples, those that begin with ``start``."""
    return [path.stem for path in sorted(EXAMPLES.glob(f"{start}*.txt"))]


def runs(part: str, steps: str) -> list[list[str]]:
    """Return the arguments of each run of an example."""
    short = [[SHORT, "--game", scenario] for scenario in GAMES]
    return [steps.split()] * (part != "games") + short * (part != "train")


def run(name: str, arguments: Sequence[str]) -> str:
    """Install what an example needs, if that has changed, and return what it prints."""
    log = HOME / f"{name}.log"
    python = install(name, log)
    return call("failed", [python, EXAMPLES / f"{name}.py", *arguments], log)


def install(name: str, log: Path) -> Path:
    """Make the environment of an example, unless its pins are installed; return its Python."""
    folder, pins = HOME / name, EXAMPLES / f"{name}.txt"
    python, stamp = folder / "bin" / "python", folder / "installed.txt"
    if not stamp.exists() or stamp.read_text() != pins.read_text():
        shutil.rmtree(folder, ignore_errors=True)
        venv.create(folder, with_pip=True)
        pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        call("not installed", [*pip, "-r", pins, "-e", ROOT], log)
        shutil.copy(pins, stamp)
    return python


def call(problem: str, command: Sequence[Any], log: Path) -> str:
    """Run a command, add its output to ``log``, and return what it prints on stdout.

    Raises
    ------
    StoppedError
        If it fails or takes too long; the message is ``problem`` and its last line.
    """
    try:
        done = subprocess.run(
            command, cwd=HOME, capture_output=True, text=True, timeout=3600 * HOURS, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise StoppedError(f"{problem}: takes more than {HOURS:g} hours") from error
    with log.open("a", encoding="utf-8") as stream:
        stream.write(done.stdout + done.stderr)
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines() or ["no output"]
        raise StoppedError(f"{problem}: {lines[-1].strip()}")
    return done.stdout


def table(output: str) -> list[str]:
    """Return the lines of the table that an example prints last: ``player`` and what follows."""
    lines = output.splitlines()
    titles = [k for k, text in enumerate(lines) if text.startswith("player ")]
    return [text.rstrip() for text in lines[titles[-1] :]] if titles else []


if __name__ == "__main__":
    main()
