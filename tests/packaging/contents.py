"""What a wheel and a source archive contain, and must not contain."""

from __future__ import annotations

import tarfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("ppg_env", "solvers", "baselines", "benchmarks")
TYPED = ("ppg_env", "solvers", "baselines")
KINDS = {".py", ".pyi", ".typed", ".npz", ".html", ".css", ".js"}
"""Endings of the files in a wheel's packages."""

DATA = (
    "baselines/pretrained/",
    "benchmarks/comparison/drawing.js",
    "benchmarks/comparison/viewer.html",
    "benchmarks/comparison/viewer.js",
    "benchmarks/reproduction/explorer.js",
    "benchmarks/reproduction/page.css",
    "benchmarks/reproduction/page.html",
)
LIBRARY = ("benchmarks/library/games/", "benchmarks/library/runs/")
"""Read from a checkout, and not part of the wheel."""

SOURCES = ("README.md", "CHANGELOG.md", "LICENSE", "Makefile", "constraints.txt", "setup.py",
           "docs/model.md", "tests/conftest.py", "examples/figures.py", *LIBRARY)  # fmt: skip
"""What a source archive has in addition to the packages."""

LARGEST_WHEEL = 4 << 20
"""Most bytes of a wheel; the 30 trained players take 3.5 million."""


def version() -> str:
    """Return the version, which has one home."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return str(project["version"])


def defects_of_wheel(wheel: Path) -> list[str]:
    """Return what is wrong with the contents of a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        info = f"path_planning_games-{version()}.dist-info"
        head = archive.read(f"{info}/METADATA").decode()
        entry = archive.read(f"{info}/entry_points.txt").decode()
    files = [name for name in names if not name.startswith(info)]
    expected = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py*")
        if path.suffix in (".py", ".pyi") and not path.as_posix().startswith(_library())
    }
    defects = [f"lacks {name}" for name in sorted(expected - set(files))]
    defects += [f"lacks {name}" for name in DATA if not any(f.startswith(name) for f in files)]
    defects += [
        f"lacks {package}/py.typed" for package in TYPED if f"{package}/py.typed" not in files
    ]
    for name in files:
        outside = name.split("/")[0] not in PACKAGES or name.startswith(LIBRARY)
        if outside or Path(name).suffix not in KINDS:
            defects.append(f"contains {name}")
    defects += ["lacks the licence"] * (f"{info}/licenses/LICENSE" not in names)
    defects += ["has no command ppg"] * ("ppg = benchmarks.cli:main" not in entry)
    defects += ["has another version"] * (f"\nVersion: {version()}\n" not in head)
    size = wheel.stat().st_size
    return defects + [f"has {size} bytes"] * (size > LARGEST_WHEEL)


def _library() -> tuple[str, ...]:
    return tuple((ROOT / name).as_posix() for name in LIBRARY)


def defects_of_sources(archive: Path) -> list[str]:
    """Return what is wrong with the contents of a source archive."""
    with tarfile.open(archive) as tar:
        names = [name.partition("/")[2] for name in tar.getnames()]
    defects = [f"lacks {name}" for name in SOURCES if not any(n.startswith(name) for n in names)]
    caches = ("__pycache__", ".pyc", "_build/", ".venv", ".git/", "out/")
    return defects + [f"contains {n}" for n in names if any(part in n for part in caches)]
