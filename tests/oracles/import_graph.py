"""The import graph of a source tree, read from its syntax: files, folders, cycles.

A *file* is named by its dotted module path; the ``__init__.py`` of a package has the name of the
package.  An edge (a, b) says that file a imports file b, at its top or inside a function, or names
it in a string, such as the target of ``import_module``; an f-string names every file that fits it.
Imports under ``if TYPE_CHECKING`` are left out: they never run.  A name imported from a package
whose ``__init__.pyi`` lists it counts as an import of the file that defines it, since lazy loading
ends up there.
"""

from __future__ import annotations

import ast
import fnmatch
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

Graph = dict[str, set[str]]
"""Edges by importer; every node is a key."""

ANY = "*"
"""In place of a part of a module's name: whatever an f-string has there."""


@dataclass(frozen=True)
class Tree:
    """The Python files of some top-level packages.

    Attributes
    ----------
    files : path of each file, by its dotted name
    doors : for each package with an ``__init__.pyi``, the file that defines each exported name
    """

    files: dict[str, Path]
    doors: dict[str, dict[str, str]]

    def resolve(self, module: str, name: str | None) -> set[str]:
        """Return the files behind ``from module import name``; none if outside the tree."""
        if ANY in module:
            parts = len(module.split("."))
            same = {file for file in self.files if len(file.split(".")) == parts}
            return set(fnmatch.filter(same, module))
        if name is not None and name in self.doors.get(module, {}):
            return {self.doors[module][name]}
        candidates = (f"{module}.{name}", module)
        return set([file for file in candidates if file in self.files][:1])


def read_tree(root: Path, packages: Iterable[str]) -> Tree:
    """Read the names of all files below ``root/PACKAGE``."""
    paths = [path for package in packages for path in sorted((root / package).rglob("*.py"))]
    files = {_dotted(path.relative_to(root)): path for path in paths}
    doors = {name: _exports(name, path.with_suffix(".pyi")) for name, path in files.items()}
    return Tree(files, {name: door for name, door in doors.items() if door})


def _dotted(path: Path) -> str:
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _exports(package: str, stub: Path) -> dict[str, str]:
    if stub.name != "__init__.pyi" or not stub.exists():
        return {}
    body = ast.parse(stub.read_text(encoding="utf-8")).body
    lines = [node for node in body if isinstance(node, ast.ImportFrom)]
    return {
        alias.asname or alias.name: f"{package}.{node.module}"
        for node in lines
        for alias in node.names
    }


def file_graph(tree: Tree) -> Graph:
    """Return which file imports which."""
    graph: Graph = {}
    for name, path in tree.files.items():
        syntax = ast.parse(path.read_text(encoding="utf-8"))
        package = name if path.name == "__init__.py" else name.rpartition(".")[0]
        targets = [tree.resolve(module, what) for module, what in imports(syntax, package)]
        graph[name] = set().union(*targets) - {name}
    return graph


def imports(syntax: ast.AST, package: str = "") -> Iterator[tuple[str, str | None]]:
    """Yield module and imported name of every import that can run and of every module in a string.

    ``package`` is the package of the file, from which relative imports count.
    """
    for node in _running(syntax):
        if isinstance(node, ast.Import):
            yield from ((alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = _absolute(node, package)
            yield from ((module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            if isinstance(node.args[0], ast.JoinedStr):
                values = [getattr(part, "value", ANY) for part in node.args[0].values]
                parts = [value if isinstance(value, str) else ANY for value in values]
                if parts[0] != ANY:  # else nothing is known of the package
                    yield "".join(parts), None
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and "." in node.value:
            yield node.value, None  # `Tree.resolve` drops what is not the name of a file


def _absolute(node: ast.ImportFrom, package: str) -> str:
    if not node.level:
        return str(node.module)
    parts = package.split(".")
    return ".".join([*parts[: len(parts) - node.level + 1], *filter(None, [node.module])])


def _running(syntax: ast.AST) -> Iterator[ast.AST]:
    """Walk all nodes except those under ``if TYPE_CHECKING``."""
    yield syntax
    for child in ast.iter_child_nodes(syntax):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            for other in child.orelse:
                yield from _running(other)
        else:
            yield from _running(child)


def children_graph(graph: Graph, package: str) -> Graph:
    """Return which child of ``package`` imports which; '' stands for the root of the tree.

    The children are the sub-folders and the files of the package; a file further down counts as the
    child that holds it.  The ``__init__.py`` of the package is a child with the package's name.
    """
    children: Graph = {}
    for importer, targets in graph.items():
        source = _child(importer, package)
        if source is not None:
            ends = {_child(target, package) for target in targets} - {None, source}
            children.setdefault(source, set()).update(child for child in ends if child)
    return children


def _child(name: str, package: str) -> str | None:
    prefix = f"{package}." if package else ""
    if name == package:
        return package
    if not name.startswith(prefix):
        return None
    return prefix + name[len(prefix) :].split(".")[0]


def folders(names: Iterable[str]) -> list[str]:
    """Return '' and the name of every package that holds other files."""
    return sorted({name.rpartition(".")[0] for name in names} | {""})


def cycles(graph: Graph) -> list[list[str]]:
    """Return the strongly connected components of more than one node, each sorted (Tarjan)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    components: list[list[str]] = []

    def visit(node: str) -> None:
        low[node] = index[node] = len(index)
        stack.append(node)
        for target in sorted(graph.get(node, ())):
            if target not in index:
                visit(target)
                low[node] = min(low[node], low[target])
            elif target in stack:
                low[node] = min(low[node], index[target])
        if low[node] == index[node]:
            start = stack.index(node)
            components.append(sorted(stack[start:]))
            del stack[start:]

    for node in sorted(graph):
        if node not in index:
            visit(node)
    return sorted(component for component in components if len(component) > 1)
