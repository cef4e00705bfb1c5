"""The gallery and the tutorials run, and import public doors only."""

from __future__ import annotations

import re
import runpy
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from tests.test_architecture import beyond_the_doors

DOCS = Path(__file__).parents[1] / "docs"
EXAMPLES = sorted((DOCS / "gallery").glob("*.py"))
TUTORIALS = sorted(page for page in (DOCS / "tutorials").glob("*.md") if page.stem != "index")


def cells(page: Path) -> str:
    """Return the code of a notebook."""
    return "".join(
        re.findall(r"^```\{code-cell\} ipython3\n(.*?)^```", page.read_text(), re.S | re.M)
    )


def test_there_is_something_to_see() -> None:
    assert len(EXAMPLES) >= 16
    assert len(TUTORIALS) == 4
    assert all(path.name.startswith("plot_") for path in EXAMPLES), "only these are run"


@pytest.mark.parametrize("path", [*EXAMPLES, *TUTORIALS], ids=lambda path: path.stem)
def test_they_import_public_doors_only(path: Path) -> None:
    code = path.read_text() if path.suffix == ".py" else cells(path)
    assert beyond_the_doors(f"```python\n{code}\n```") == []


@pytest.fixture
def figures() -> Iterator[ModuleType]:
    """Give pyplot without a window, and without figures left over."""
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")
    plt.close("all")
    yield plt
    plt.close("all")


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_draws_its_picture(path, figures, monkeypatch):
    monkeypatch.chdir(path.parent)
    runpy.run_path(str(path))
    assert figures.get_fignums()


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda path: path.stem)
def test_a_tutorial_runs(page, figures, monkeypatch):
    monkeypatch.chdir(page.parent)
    exec(compile(cells(page), page.name, "exec"), {})
    assert figures.get_fignums()
