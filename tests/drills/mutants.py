"""Mutants: copies of a module with one small change each."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Add, ast.Div: ast.Mult, ast.MatMult: ast.Add,
    ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.Add,
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or, ast.Or: ast.And,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
NAMES = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all",
         "all": "any", "argmax": "argmin", "argmin": "argmax", "sum": "max", "cumsum": "cumprod",
         "zeros": "ones", "ones": "zeros"}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """Source of a changed module, and what was changed in which line."""

    source: str
    line: int
    change: str


def count_mutants(source: str, functions: frozenset[str] = frozenset()) -> int:
    """Return the number of mutants of a module, or of those inside ``functions``."""
    return sum(1 for _ in _changes(ast.parse(source), functions))


def make_mutant(source: str, k: int, functions: frozenset[str] = frozenset()) -> Mutant:
    """Return the ``k``-th mutant, counted from 0."""
    tree = ast.parse(source)
    for j, (node, change) in enumerate(_changes(tree, functions)):
        if j == k:
            return Mutant(ast.unparse(tree), node.lineno, change)
    raise IndexError(k)


def _changes(
    tree: ast.Module, functions: frozenset[str]
) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    """Yield node and description of each change after making it; go on to undo it."""
    unread = _annotations(tree)
    for scope in ast.walk(tree):
        if not isinstance(scope, ast.FunctionDef) or (functions and scope.name not in functions):
            continue
        for node in ast.walk(scope):
            if node in unread or (isinstance(node, ast.FunctionDef) and node is not scope):
                continue
            yield from _of_node(node)
            for body in (getattr(node, "body", None), getattr(node, "orelse", None)):
                if isinstance(body, list):
                    yield from _dropped(body)


def _annotations(tree: ast.Module) -> frozenset[ast.AST]:
    """Return the nodes of annotations, which no code reads."""
    roots = [
        annotation
        for node in ast.walk(tree)
        for annotation in (getattr(node, "annotation", None), getattr(node, "returns", None))
        if annotation is not None
    ]
    return frozenset(node for root in roots for node in ast.walk(root))


def _of_node(node: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    if isinstance(node, (ast.BinOp, ast.AugAssign, ast.BoolOp)) and type(node.op) in SWAPS:
        old = node.op
        node.op = SWAPS[type(old)]()  # type: ignore[assignment]
        yield node, f"{type(old).__name__} to {type(node.op).__name__}"
        node.op = old
    elif isinstance(node, ast.Compare):
        for k, old_op in enumerate(node.ops):
            node.ops[k] = SWAPS[type(old_op)]()  # type: ignore[call-overload]
            yield node, f"{type(old_op).__name__} to {type(node.ops[k]).__name__}"
            node.ops[k] = old_op
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        value = node.value
        node.value = not value if isinstance(value, bool) else value + 1
        yield node, f"{value} to {node.value}"
        node.value = value
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not, ast.Invert)):
        old_unary = node.op
        node.op = ast.UAdd() if not isinstance(old_unary, ast.Not) else ast.Not()
        kept = node.operand
        if isinstance(old_unary, ast.Not):
            node.operand = ast.UnaryOp(ast.Not(), kept)
        yield node, f"{type(old_unary).__name__} dropped"
        node.op, node.operand = old_unary, kept
    elif isinstance(node, ast.Attribute) and node.attr in NAMES:
        name = node.attr
        node.attr = NAMES[name]
        yield node, f"{name} to {node.attr}"
        node.attr = name
    elif isinstance(node, ast.Name) and node.id in ("min", "max", "any", "all"):
        name = node.id
        node.id = NAMES[name]
        yield node, f"{name} to {node.id}"
        node.id = name


def _dropped(body: list[ast.stmt]) -> Iterator[tuple[ast.stmt, str]]:
    for k, statement in enumerate(body):
        docstring = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
        if (
            isinstance(statement, (ast.Assign, ast.AugAssign, ast.Expr, ast.Continue))
            and not docstring
        ):
            body[k] = ast.copy_location(ast.Pass(), statement)
            yield statement, f"dropped: {ast.unparse(statement).splitlines()[0]:.60}"
            body[k] = statement
