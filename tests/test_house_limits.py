"""Limits of the code's size, names that exist once, and docstrings on everything public."""

from __future__ import annotations

import ast
import statistics
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from textwrap import dedent

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("ppg_env", "solvers", "baselines", "benchmarks")
FILES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]

FILE_LINES, FILE_MEDIAN, FUNCTION_P95, PARAMETERS = 300, 110, 35, 12
KERNEL_FILES = {"kernel", "compiled"}
"""Compiled code takes arrays one by one; the limit of parameters does not hold there."""

GRAB_BAGS = {"utils", "util", "helpers", "helper", "common", "misc"}
UNIQUE_CLASSES = {"Game", "Row", "Answer"}
Function = ast.FunctionDef | ast.AsyncFunctionDef


def relative(path: Path) -> str:
    return str(path.relative_to(ROOT))


def parse(path: Path) -> ast.Module:
    return tree(path.read_text(encoding="utf-8"))


@cache
def tree(text: str) -> ast.Module:
    return ast.parse(text)


@cache
def nodes(text: str) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(tree(text)))


def every_node(path: Path) -> tuple[ast.AST, ...]:
    return nodes(path.read_text(encoding="utf-8"))


def lines(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


def functions(path: Path) -> list[Function]:
    """Return all functions of a file, methods and inner ones too."""
    return [node for node in every_node(path) if isinstance(node, Function)]


def length(function: Function) -> int:
    assert function.end_lineno is not None
    return function.end_lineno - function.lineno + 1


def compiled(paths: list[Path]) -> set[str]:
    """Return the functions that ``njit(...)(function)`` compiles."""
    calls = [node for path in paths for node in every_node(path) if isinstance(node, ast.Call)]
    return {ast.unparse(call.args[0]) for call in calls if call.args and _is_njit(call.func)}


def _is_njit(node: ast.AST) -> bool:
    return "njit" in ast.unparse(node).split("(")[0]


def crowded(path: Path, exempt: set[str]) -> list[str]:
    """Return the functions of a file with too many parameters; compiled code is exempt."""
    if path.stem in KERNEL_FILES:
        return []
    return [
        f"{path.name}:{function.lineno} {function.name}: {parameters(function)}"
        for function in functions(path)
        if parameters(function) > PARAMETERS
        and function.name not in exempt
        and not any(map(_is_njit, function.decorator_list))
    ]


def parameters(function: Function) -> int:
    """Return the number of parameters; ``self`` and ``cls`` do not count."""
    names = [a.arg for a in (*function.args.posonlyargs, *function.args.args)]
    own = names[:1] in (["self"], ["cls"])
    return len(names) + len(function.args.kwonlyargs) - own


def p95(values: list[int]) -> int:
    return sorted(values)[int(0.95 * len(values))]


def classes(paths: list[Path]) -> Counter[str]:
    """Count the classes by name."""
    nodes = [node for path in paths for node in every_node(path)]
    return Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))


def undocumented(tree: ast.Module) -> Iterator[str]:
    """Yield public functions, classes and methods without a docstring, and the module itself."""
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


def test_no_file_is_long() -> None:
    assert {relative(p): lines(p) for p in FILES if lines(p) > FILE_LINES} == {}


def test_the_median_file_is_short() -> None:
    assert statistics.median(map(lines, FILES)) <= FILE_MEDIAN


def test_functions_are_short() -> None:
    assert p95([length(function) for path in FILES for function in functions(path)]) <= FUNCTION_P95


def test_no_function_has_many_parameters() -> None:
    exempt = compiled(FILES)
    assert [entry for path in FILES for entry in crowded(path, exempt)] == []


@pytest.mark.parametrize("name", sorted(UNIQUE_CLASSES))
def test_a_general_class_name_is_used_once(name: str) -> None:
    assert classes(FILES)[name] <= 1


def test_no_file_is_a_grab_bag() -> None:
    every = [*FILES, *(ROOT / "tests").rglob("*.py")]
    assert [relative(path) for path in every if path.stem in GRAB_BAGS] == []


def test_everything_public_is_documented() -> None:
    missing = {relative(path): list(undocumented(parse(path))) for path in FILES}
    assert {path: names for path, names in missing.items() if names} == {}


def test_the_checks_of_size_bite(tmp_path: Path) -> None:
    body = "\n".join(f"    x{k} = {k}" for k in range(40))
    names = ", ".join(f"a{k}" for k in range(PARAMETERS))
    path = tmp_path / "long.py"
    path.write_text(f"class A:\n  def f(self, {names}):\n    def g(b, {names}, *, c): ...\n{body}")
    assert lines(path) == 43
    assert [length(function) for function in functions(path)] == [42, 1]
    assert crowded(path, set()) == ["long.py:3 g: 14"]
    assert crowded(path.rename(tmp_path / "kernel.py"), set()) == []
    path.write_text(f"@nb.njit(cache=True)\ndef g(b, {names}): ...")
    assert crowded(path, set()) == []
    path.write_text(f"def g(b, {names}): ...\nh = njit(cache=True)(g)")
    assert compiled([path]) == {"g"}
    assert crowded(path, {"g"}) == []
    assert p95([*range(100)]) == 95


def test_the_check_of_class_names_bites(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.py").write_text("class Row: ...\nclass Table: ...")
    assert classes(sorted(tmp_path.glob("*.py"))) == {"Row": 2, "Table": 2}


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
