"""The recipes of CONTRIBUTING.md work when their text is followed literally.

Marks in the page say what to do with the block after them: ``file: PATH`` writes a new file,
``in: PATH after: TEXT`` adds lines below the only line that holds TEXT, ``run`` runs commands.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.marks import slow_if

ROOT = Path(__file__).parents[1]
PACKAGES = ("ppg_env", "solvers", "baselines", "benchmarks")
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
STEP = re.compile(r"<!-- (file|in|run):? ?(.*?) ?-->\n```\w+\n(.*?)```", re.S)
RECIPES = [title for title in re.findall(r"^## (.*)$", PAGE, re.M) if title.startswith("Add a ")]


def steps(recipe: str) -> list[tuple[str, str, str]]:
    """Return (what to do, where, text) for each marked block of a recipe."""
    section = PAGE.split(f"## {recipe}\n")[1].split("\n## ")[0]
    return STEP.findall(section)


def write(root: Path, kind: str, where: str, text: str) -> None:
    """Write a new file, or add lines to one."""
    name, _, anchor = where.partition(" after: ")
    path = root / name
    if kind == "file":
        assert not path.exists()
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        return
    (line,) = [line for line in path.read_text().splitlines() if anchor in line]
    path.write_text(path.read_text().replace(line, f"{line}\n{text.rstrip()}"))


def run(root: Path, *words: str) -> subprocess.CompletedProcess[str]:
    settings = {**os.environ, "PYTHONPATH": str(root)}
    return subprocess.run(
        [sys.executable, *words], cwd=root, env=settings, capture_output=True, text=True
    )


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a copy of the packages that a recipe may change."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package)  # compiled kernels in __pycache__, too
    return tmp_path


def test_there_are_recipes() -> None:
    assert [recipe.split()[-1] for recipe in RECIPES] == ["scenario", "player", "solver", "study"]
    assert all(kind == "run" for recipe in RECIPES for kind, _, _ in steps(recipe)[-1:])


@pytest.mark.parametrize(
    "recipe", slow_if(lambda recipe: recipe.split()[-1] != "scenario", RECIPES)
)
def test_a_recipe_works_as_written(recipe: str, copy: Path) -> None:
    commands = []
    for kind, where, text in steps(recipe):
        if kind == "run":
            commands += [shlex.split(line)[1:] for line in text.splitlines()]
        else:
            write(copy, kind, where, text)
    assert commands
    for words in commands:
        done = run(copy, "-m", "benchmarks", *words)
        assert done.returncode == 0, done.stderr


def test_the_check_of_recipes_bites(copy: Path) -> None:
    kind, where, text = steps("Add a scenario")[0]
    write(copy, kind, where, text.replace("import Course", "import Track"))
    assert run(copy, "-m", "benchmarks", "show", "crossroads").returncode != 0
