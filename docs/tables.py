"""Two directives whose content comes from the program itself.

``{scenarios}`` is a table of the registered scenarios, ``{commands}`` a section for each verb of
``ppg`` with its arguments and options.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from types import UnionType
from typing import Any, get_args

from docutils import nodes
from sphinx.util.docutils import SphinxDirective


class Scenarios(SphinxDirective):
    """Every scenario and family with its first line of documentation."""

    def run(self) -> list[nodes.Node]:
        """Build the table."""
        from ppg_env import scenarios

        rows = [(f"`{call}`", what) for call, what in scenarios().items()]
        return self.parse_text_to_nodes(_table(("scenario", "what it is"), rows))


class Commands(SphinxDirective):
    """Every verb of ``ppg``: what it does, its arguments and its options."""

    def run(self) -> list[nodes.Node]:
        """Build one section per verb."""
        from benchmarks.cli import app

        verbs = [_verb(verb.name, verb.callback) for verb in app.registered_commands]
        return self.parse_text_to_nodes("\n\n".join(verbs), allow_section_headings=True)


def _verb(name: str | None, command: Callable[..., None] | None) -> str:
    assert name is not None
    assert command is not None
    parameters = inspect.signature(command, eval_str=True).parameters.values()
    table = _table(("argument", "meaning", "default"), [_row(p) for p in parameters])
    return f"## `ppg {name}`\n\n{inspect.getdoc(command)}\n\n{table}"


def _row(parameter: inspect.Parameter) -> tuple[str, str, str]:
    """How a parameter is written, its help, and its default; by its ``Annotated`` type."""
    from typer.models import ArgumentInfo

    kind, info = (get_args(parameter.annotation) or (parameter.annotation, None))[:2]
    if isinstance(kind, UnionType):  # str | None
        kind = get_args(kind)[0]
    meaning = getattr(info, "help", None) or ""
    if isinstance(info, ArgumentInfo):
        return f"`{info.metavar or parameter.name.upper()}`", meaning, ""
    # Inside Annotated, typer keeps an option's explicit name where its default would be.
    explicit = getattr(info, "default", None)
    name = explicit if isinstance(explicit, str) else f"--{parameter.name.replace('_', '-')}"
    value = getattr(info, "metavar", None) or {int: "INTEGER", float: "NUMBER"}.get(kind, "TEXT")
    shown = name if kind is bool else f"{name} {value}"
    default = "" if parameter.default in (None, False) else f"`{parameter.default}`"
    return f"`{shown}`", meaning, default


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    escaped = [[cell.replace("|", "\\|") for cell in line] for line in lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in escaped)


def setup(app: Any) -> dict[str, bool]:
    """Register the directives."""
    app.add_directive("scenarios", Scenarios)
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
