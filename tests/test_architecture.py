"""The shape of the code: which way imports go, what importing costs, what is documented."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from textwrap import dedent

import pytest

ROOT = Path(__file__).parents[1]
LAYERS = ("ppg_env", "solvers", "baselines", "benchmarks")
"""Each may import those before it, and itself."""

FILES = [path for layer in LAYERS for path in sorted((ROOT / layer).rglob("*.py"))]
NAMELESS = {"utils", "util", "helpers", "helper", "common", "misc"}
HEAVY = (
    "cvxpy", "torch", "matplotlib", "scipy.optimize", "stable_baselines3", "PIL", "joblib",
    "sqlite3", "pyarrow", "distributed", "ray",
)  # fmt: skip


def relative(path: Path) -> str:
    return str(path.relative_to(ROOT))


def imported(tree: ast.AST) -> Iterator[str]:
    """Top-level packages of all imports, those within functions too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name.split(".")[0] for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield str(node.module).split(".")[0]
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "import_module":
            (text, *_) = node.args
            if isinstance(text, ast.Constant):
                yield str(text.value).split(".")[0]


def test_there_are_files_to_check() -> None:
    assert {path.relative_to(ROOT).parts[0] for path in FILES} == set(LAYERS)


@pytest.mark.parametrize("path", FILES, ids=relative)
def test_imports_go_one_way(path: Path) -> None:
    layer = path.relative_to(ROOT).parts[0]
    above = LAYERS[LAYERS.index(layer) + 1 :]
    assert not set(imported(ast.parse(path.read_text(encoding="utf-8")))).intersection(above)


def test_the_check_of_imports_bites() -> None:
    code = "def f():\n    if x:\n        from solvers.reference.formulation import Program\n"
    assert "solvers" in set(imported(ast.parse(code)))
    assert "benchmarks" in set(imported(ast.parse("import benchmarks.cli as c")))


def test_no_file_is_a_grab_bag() -> None:
    everything = [*FILES, *(ROOT / "tests").rglob("*.py")]
    assert not [relative(path) for path in everything if path.stem in NAMELESS]


@pytest.mark.parametrize("module", ["ppg_env", "solvers", "baselines", "benchmarks.cli"])
def test_importing_costs_nothing(module: str) -> None:
    code = f"import json, sys, {module}; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    loaded = set(json.loads(done.stdout))
    assert module in loaded
    assert not loaded.intersection(HEAVY)


@pytest.mark.parametrize("module", ["ppg_env", "solvers", "baselines"])
def test_every_public_name_exists(module: str) -> None:
    loaded = import_module(module)
    for name in loaded.__all__:
        assert getattr(loaded, name) is not None


def test_a_name_that_is_not_there_says_so() -> None:
    with pytest.raises(AttributeError, match="no_such_planner"):
        import_module("solvers").no_such_planner  # noqa: B018 - the access is what is tested


def undocumented(tree: ast.Module) -> Iterator[str]:
    """Public functions, classes and methods without a docstring, and the module itself."""
    if not ast.get_docstring(tree):
        yield "the module"
    inner: list[tuple[str, ast.AST]] = [("", tree)]
    while inner:
        prefix, scope = inner.pop()
        for node in ast.iter_child_nodes(scope):
            if not isinstance(node, (ast.FunctionDef, ast.ClassDef)) or node.name.startswith("_"):
                continue
            setter = any(getattr(mark, "attr", "") == "setter" for mark in node.decorator_list)
            if not ast.get_docstring(node) and not setter:
                yield prefix + node.name
            if isinstance(node, ast.ClassDef):
                inner.append((f"{prefix}{node.name}.", node))


@pytest.mark.parametrize("path", FILES, ids=relative)
def test_everything_public_is_documented(path: Path) -> None:
    assert not list(undocumented(ast.parse(path.read_text(encoding="utf-8"))))


def test_the_check_of_docstrings_bites() -> None:
    code = """
    'The module.'
    class A:
        'A.'
        def f(self): ...
        def _g(self): ...
    def h(): ...
    """
    assert sorted(undocumented(ast.parse(dedent(code)))) == ["A.f", "h"]
