"""An environment that has nothing but the wheel and what it needs, outside the source tree."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.drills.figures import ROOT

PLACE = ROOT / ".venv-wheel"


def run_clean(words: Sequence[object], folder: Path) -> None:
    """Run a program where nothing of this checkout is on Python's path."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    subprocess.run(list(map(str, words)), cwd=folder, env=clean, check=True, stdout=sys.stderr)


def build_wheel(folder: Path) -> Path:
    """Build the wheel of this checkout into ``folder``, and return its path."""
    run_clean([sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, ROOT], folder)
    (wheel,) = folder.glob("path_planning_games-*.whl")
    return wheel


def wheel_environment(folder: Path, extra: str) -> Path:
    """Return the folder of the programs of an environment with the wheel and one of its extras."""
    wheel, programs = build_wheel(folder), PLACE / "bin"
    if not (programs / "python").exists():
        run_clean([sys.executable, "-m", "venv", PLACE], folder)
    pip = [programs / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    run_clean([*pip, "-c", ROOT / "constraints.txt", f"{wheel}[{extra}]"], folder)
    run_clean([*pip, "--force-reinstall", "--no-deps", wheel], folder)
    return programs
