"""Build wheel and source archive, install the wheel outside the tree, and run it.

    python -m tests.packaging.clean_install [PYTHON ...]

The wheel is built from the source archive.  For each interpreter, by default the one that runs
this, it is installed into a new environment in a temporary folder, and started from there.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.drills.wheel import run_clean
from tests.packaging.contents import ROOT, defects_of_sources, defects_of_wheel, version

COMPARE = ("compare", "head_on", "--speed", "l1", "--objective", "risk", "--lam", "0.8")
COMMANDS: tuple[tuple[str, ...], ...] = (
    ("--version",),
    (*COMPARE, "--gain", "0", "--episodes", "2000"),
    (*COMPARE, "--players", "nash,social,ppo-selfish", "--episodes", "2000", "--out", "plans.png"),
    ("solve", "circle(4)", "--out", "circle.json"),
    ("certify", "circle.json"),
)
PAGES = ("README.md", "docs/index.md")
"""Pages whose quick starts in Python run from the wheel."""


def quick_starts() -> list[str]:
    """Return the examples in Python of ``PAGES``."""
    texts = [(ROOT / page).read_text(encoding="utf-8") for page in PAGES]
    found = [re.findall(r"^```python\n(.*?)^```", text, re.S | re.M) for text in texts]
    return [code for codes in found for code in codes]


def main(pythons: list[str]) -> int:
    """Build, check, install and run; return the exit code."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wheel, defects = build(folder)
        for python in pythons or [sys.executable]:
            if not defects:
                defects = runs(python, wheel, folder / Path(python).parent.parent.name)
    sys.stdout.write("".join(f"{defect}\n" for defect in defects) or "wheel and sources are fine\n")
    return int(bool(defects))


def build(folder: Path) -> tuple[Path, list[str]]:
    """Build both archives into ``folder``; return the wheel, and what is wrong with them."""
    tools, dist = folder / "tools", folder / "dist"
    python = tools / "bin" / "python"
    run_clean([sys.executable, "-m", "venv", tools], folder)
    run_clean(
        [python, "-m", "pip", "install", "-q", "--disable-pip-version-check", "build"], folder
    )
    run_clean([python, "-m", "build", "--outdir", dist, ROOT], folder)
    (wheel,), (sources,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
    return wheel, defects_of_wheel(wheel) + defects_of_sources(sources)


def runs(python: str, wheel: Path, place: Path) -> list[str]:
    """Install the wheel with this interpreter, and run it; return what is wrong."""
    place.mkdir(parents=True)
    programs = place / "venv" / "bin"
    run_clean([python, "-m", "venv", place / "venv"], place)
    pip = [programs / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    run_clean([*pip, "-c", ROOT / "constraints.txt", f"{wheel}[render]"], place)
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    commands = [[str(programs / "ppg"), *words] for words in COMMANDS]
    commands += [[str(programs / "python"), "-c", code] for code in quick_starts()]
    defects = []
    for words in commands:
        done = subprocess.run(
            words, cwd=place, env=clean, capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            defects.append(f"{python}: {' '.join(words[:4])}: {done.stderr[-500:]}")
        if words[1] == "--version" and done.stdout.strip() != f"ppg {version()}":
            defects.append(f"{python}: another version: {done.stdout!r}")
    return defects


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
