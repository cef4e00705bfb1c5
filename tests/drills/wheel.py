"""An environment that has nothing but the wheel and what it needs, outside the source tree."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.drills.figures import ROOT

PLACE = ROOT / ".venv-wheel"


def build_wheel(folder: Path) -> Path:
    """Build the wheel of this checkout into ``folder``, and return its path."""
    words = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "-w",
        str(folder),
        str(ROOT),
    ]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    (wheel,) = folder.glob("path_planning_games-*.whl")
    return wheel


def wheel_environment(folder: Path, extra: str) -> Path:
    """Return the folder of the programs of an environment with the wheel and one of its extras."""
    wheel, programs = build_wheel(folder), PLACE / "bin"
    if not (programs / "python").exists():
        subprocess.run([sys.executable, "-m", "venv", str(PLACE)], check=True)
    pip = [
        str(programs / "python"),
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ]
    constraints = ["-c", str(ROOT / "constraints.txt")]
    subprocess.run([*pip, *constraints, f"{wheel}[{extra}]"], check=True)
    subprocess.run([*pip, "--force-reinstall", "--no-deps", str(wheel)], check=True)
    return programs
