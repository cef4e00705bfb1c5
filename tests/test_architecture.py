"""Imports: their direction, no cycles of files or folders, their cost, and the picture of them."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import tomllib
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import pytest

from tests.oracles.import_graph import (
    Graph,
    children_graph,
    cycles,
    file_graph,
    folders,
    imports,
    read_tree,
)

ROOT = Path(__file__).parents[1]
PACKAGES = ("ppg_env", "solvers", "baselines", "benchmarks")
"""Each may import those before it, and itself."""

TREE = read_tree(ROOT, PACKAGES)
GROUND = {"errors", "tolerances"}
"""Imported by most files; the picture draws no arrows to them."""

DOORS = (
    "ppg_env", "ppg_env.game", "ppg_env.env", "ppg_env.risk", "ppg_env.plotting", "solvers",
    "baselines", "benchmarks.sweeps",
)  # fmt: skip
HEAVY = (
    "cvxpy", "torch", "matplotlib", "scipy.optimize", "stable_baselines3", "PIL", "joblib",
    "sqlite3", "pyarrow", "distributed", "ray", "tensordict", "torchrl", "pufferlib",
)  # fmt: skip
ADAPTERS = {"GameTorchRLEnv": "torchrl", "GamePufferEnv": "pufferlib"}
"""Public names that need a library which the tests do without."""


@cache
def own_graph() -> Graph:
    """Return the import graph of the packages, read at the first use."""
    return file_graph(TREE)


def graph_of(root: Path, files: dict[str, str]) -> dict[str, set[str]]:
    """Write a small tree of files and return its import graph."""
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return file_graph(read_tree(root, sorted({name.split("/")[0] for name in files})))


def test_there_are_files_to_check() -> None:
    assert {name.split(".")[0] for name in TREE.files} == set(PACKAGES)
    assert sum(map(len, own_graph().values())) > len(own_graph())


# --- direction ------------------------------------------------------------------------------------


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_go_one_way(package: str) -> None:
    above = set(PACKAGES[PACKAGES.index(package) + 1 :])
    assert not children_graph(own_graph(), "")[package] & above


def test_the_check_of_direction_bites(tmp_path: Path) -> None:
    low = "def f():\n    if x:\n        from q.high import Program\n"
    graph = graph_of(tmp_path, {"p/low.py": low, "q/high.py": "import p.low as low\n"})
    assert children_graph(graph, "") == {"p": {"q"}, "q": {"p"}}


# --- cycles ---------------------------------------------------------------------------------------


def test_no_files_import_each_other_in_a_cycle() -> None:
    assert cycles(own_graph()) == []


@pytest.mark.parametrize("folder", folders(TREE.files), ids=lambda folder: folder or "the root")
def test_no_children_of_a_folder_import_each_other_in_a_cycle(folder: str) -> None:
    """Children are sub-folders and files; a file further down counts as the child it is in."""
    assert cycles(children_graph(own_graph(), folder)) == []


def test_the_check_of_file_cycles_bites(tmp_path: Path) -> None:
    deferred = "def f():\n    from p.b import g\n"
    files = {"p/a.py": deferred, "p/b.py": "from . import c", "p/c.py": "import p.a"}
    assert cycles(graph_of(tmp_path, files)) == [["p.a", "p.b", "p.c"]]


def test_the_check_of_folder_cycles_bites(tmp_path: Path) -> None:
    files = {"p/x/a.py": "import p.y.b", "p/x/d.py": "", "p/y/b.py": ""}
    graph = graph_of(tmp_path, {**files, "p/y/c.py": "from ..x.d import e"})
    assert cycles(graph) == []
    assert cycles(children_graph(graph, "p")) == [["p.x", "p.y"]]


def test_an_import_for_the_type_checker_is_no_edge(tmp_path: Path) -> None:
    guarded = "if TYPE_CHECKING:\n    import p.b\nelse:\n    import p.c"
    graph = graph_of(tmp_path, {"p/a.py": guarded, "p/b.py": "", "p/c.py": ""})
    assert graph["p.a"] == {"p.c"}


def test_module_names_in_strings_are_edges(tmp_path: Path) -> None:
    files = {"p/a.py": "METHODS = {'b': 'p.b'}", "p/b.py": "import_module(f'p.x.{name}')"}
    graph = graph_of(
        tmp_path, {**files, "p/x/c.py": "import_module(f'p.{x}.y.d')", "p/x/y/d.py": ""}
    )
    assert graph == {"p.a": {"p.b"}, "p.b": {"p.x.c"}, "p.x.c": {"p.x.y.d"}, "p.x.y.d": set()}


def test_a_lazily_exported_name_is_an_edge_to_its_file(tmp_path: Path) -> None:
    files = {"p/a.py": "from p.x import Thing", "p/x/c.py": "import p.a", "p/x/__init__.py": ""}
    graph = graph_of(tmp_path, {**files, "p/x/__init__.pyi": "from .c import Thing as Thing"})
    assert graph["p.a"] == {"p.x.c"}
    assert cycles(graph) == [["p.a", "p.x.c"]]


# --- the picture ----------------------------------------------------------------------------------

Picture = dict[str, dict[str, set[str]]]
"""Package -> child -> the children that it imports; the order is that of the page."""


def read_picture(page: str) -> Picture:
    """Read the boxes of the first fenced block: ``┌─ package``, then ``│ child → children``."""
    block = page.split("```text\n")[1].split("```")[0]
    picture: Picture = {}
    for line in block.splitlines():
        if header := re.match(r"┌─ (\w+) ", line):
            rows = picture.setdefault(header[1], {})
        elif row := re.match(r"│ (\w+)\s*(?:→ ([\w ]+))?│", line):
            rows[row[1]] = set((row[2] or "").split())
    for rows in picture.values():
        for child in [child for child, targets in rows.items() if targets == {"all", "below"}]:
            rows[child] = set(list(rows)[list(rows).index(child) + 1 :]) - GROUND
    return picture


def draw_rows(graph: dict[str, set[str]]) -> str:
    """Return the rows of a package as they belong into the picture."""

    def depth(child: str) -> int:
        return 1 + max((depth(target) for target in graph[child]), default=0)

    names = sorted(graph, key=lambda child: (-depth(child), child))
    width = max(map(len, names))
    ends = {child: sorted(graph[child], key=names.index) for child in names}
    texts = [f"│ {child:{width}} → {' '.join(ends[child])}".rstrip("→ ") for child in names]
    return "\n".join(f"{text:99}│" for text in texts)


def package_imports(package: str) -> dict[str, set[str]]:
    """Return the imports between the children of a package; doors and ``__main__`` left out."""
    bare = {
        child.rpartition(".")[2]: {target.rpartition(".")[2] for target in targets}
        for child, targets in children_graph(own_graph(), package).items()
        if child not in (package, f"{package}.__main__")
    }
    return {child: targets - GROUND - {package} for child, targets in bare.items()}


PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
PICTURE = read_picture(PAGE)


def test_the_picture_has_the_packages_in_the_order_of_their_imports() -> None:
    assert list(PICTURE) == list(reversed(PACKAGES))


@pytest.mark.parametrize("package", PACKAGES)
def test_the_picture_says_what_the_imports_say(package: str) -> None:
    rows = package_imports(package)
    assert PICTURE[package] == rows, f"docs/architecture.md: draw\n{draw_rows(rows)}"


@pytest.mark.parametrize("package", PACKAGES)
def test_arrows_of_the_picture_point_down(package: str) -> None:
    names = list(PICTURE[package])
    for child, targets in PICTURE[package].items():
        assert targets <= set(names[names.index(child) + 1 :]), child


@pytest.mark.parametrize("package", PACKAGES)
def test_the_picture_has_the_order_of_the_lint_contract(package: str) -> None:
    """``[tool.importlinter]`` in pyproject.toml is where the order of the folders is set."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    (layers,) = [c["layers"] for c in contracts if c.get("containers") == [package]]
    depth = {name.strip(): k for k, row in enumerate(layers) for name in re.split(r"[|:]", row)}
    assert set(depth) == set(PICTURE[package])
    assert all(depth[above] <= depth[below] for above, below in pairwise(PICTURE[package]))


def table(page: str, heading: str) -> list[list[str]]:
    """Return the cells of the table below a heading, code marks left out."""
    rows = page.split(f"## {heading}\n")[1].split("\n## ")[0].splitlines()
    cells = [[cell.strip(" `") for cell in row.strip("|").split("|")] for row in rows if "|" in row]
    return cells[2:]


def test_the_page_describes_every_folder() -> None:
    names = {folder.replace(".", "/") for folder in folders(TREE.files) if folder.count(".") == 1}
    assert {folder for folder, _ in table(PAGE, "Folders")} == names


@pytest.mark.parametrize("row", table(PAGE, "Where is it?"), ids=lambda row: row[0])
def test_the_page_names_the_file_of_each_thing(row: list[str]) -> None:
    _, path, name = row
    module = path.removesuffix(".py").replace("/", ".")
    assert not name or hasattr(import_module(module), name)


def test_the_check_of_the_picture_bites() -> None:
    graph = {"a": {"b", "c"}, "b": {"c"}, "c": set[str]()}
    page = f"```text\n┌─ p ──┐\n{draw_rows(graph)}\n└──┘\n```"
    assert read_picture(page) == {"p": graph}
    assert read_picture(page.replace("→ b c", "→ all below")) == {"p": graph}
    assert read_picture(page.replace("→ b c", "→ c")) != {"p": graph}


# --- doors and cost -------------------------------------------------------------------------------


@pytest.mark.parametrize("module", [*DOORS[:-1], "benchmarks.cli"])
def test_importing_loads_nothing_heavy(module: str) -> None:
    code = f"import json, sys, {module}; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    loaded = set(json.loads(done.stdout))
    assert module in loaded
    assert not loaded.intersection(HEAVY)


@pytest.mark.parametrize("module", DOORS)
def test_every_public_name_exists(module: str) -> None:
    door = import_module(module)
    assert door.__all__
    for name in door.__all__:
        if name in ADAPTERS and not find_spec(ADAPTERS[name]):
            continue
        assert getattr(door, name) is not None


@pytest.mark.parametrize(("name", "library"), ADAPTERS.items())
def test_an_adapter_says_which_library_is_missing(
    name: str, library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    door = import_module("baselines")
    for module in [key for key in sys.modules if key.startswith("baselines.")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.delitem(vars(door), name, raising=False)
    for module in [key for key in sys.modules if key.split(".")[0] == library]:
        monkeypatch.setitem(sys.modules, module, None)  # parts that other tests have loaded
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ImportError, match=rf"{name}: needs \w+; install path-planning-games\["):
        getattr(door, name)


def test_a_missing_name_is_named_by_the_error() -> None:
    with pytest.raises(AttributeError, match="no_such_planner"):
        import_module("solvers").no_such_planner  # noqa: B018 - the access is what is tested


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/[!_]*.md"))]


def beyond_the_doors(page: str) -> list[str]:
    """Return the modules of this project that Python examples import although they are no doors."""
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.S | re.M)
    pairs = [pair for block in blocks for pair in imports(ast.parse(block))]
    own = [(module, name) for module, name in pairs if module.split(".")[0] in PACKAGES]
    inner = [
        f"{module}.{name}"
        for module, name in own
        if f"{module}.{name}" in TREE.files and name not in TREE.doors.get(module, {})
    ]
    return sorted({*(module for module, _ in own), *inner} - set(DOORS))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_examples_import_public_doors_only(page: Path) -> None:
    assert beyond_the_doors(page.read_text(encoding="utf-8")) == []


def test_the_check_of_doors_bites() -> None:
    lines = (
        "from ppg_env import make_game, formats",
        "from solvers import budget",
        "import numpy",
    )
    page = "```python\n" + "\n".join((*lines, "import ppg_env.game.game as g")) + "\n```"
    inner = ["ppg_env.formats", "ppg_env.game.game", "solvers.budget"]
    assert beyond_the_doors(page) == inner
    assert beyond_the_doors("```python\nfrom ppg_env import scenarios\n```") == []
