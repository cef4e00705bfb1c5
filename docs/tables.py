"""Directives whose content comes from the program itself.

``{scenarios}`` is a table of the registered scenarios, ``{commands}`` a section for each verb of
``ppg`` with its arguments and options.  ``{study} NAME PART`` is what the stored results of a study
say, ``studies/NAME.json``; PART is ``question``, ``words`` or ``tables``.  ``{claims} FILE`` is the
table of the paper's claims with the verdicts in FILE, and how it was made.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from types import UnionType
from typing import Any, get_args

from docutils import nodes
from sphinx.util.docutils import SphinxDirective


class Scenarios(SphinxDirective):
    """Every scenario and family with its first line of documentation."""

    def run(self) -> list[nodes.Node]:
        """Build the table."""
        from benchmarks.studies.markdown import markdown_table
        from ppg_env import scenarios

        rows = [(f"`{call}`", what) for call, what in scenarios().items()]
        return self.parse_text_to_nodes(markdown_table(("scenario", "what it is"), rows))


class Commands(SphinxDirective):
    """Every verb of ``ppg``: what it does, its arguments and its options."""

    def run(self) -> list[nodes.Node]:
        """Build one section per verb."""
        from benchmarks.cli import app

        verbs = [_verb(verb.name, verb.callback) for verb in app.registered_commands]
        return self.parse_text_to_nodes("\n\n".join(verbs), allow_section_headings=True)


class StudyResults(SphinxDirective):
    """What the stored results of a study say; nothing is run, and no number is typed."""

    required_arguments = 2

    def run(self) -> list[nodes.Node]:
        """Build the part that is asked for."""
        from benchmarks.studies.markdown import study_markdown

        name, part = self.arguments
        path = Path(__file__).parent / "studies" / f"{name}.json"
        self.env.note_dependency(str(path))
        return self.parse_text_to_nodes(study_markdown(name, path, part))


class Claims(SphinxDirective):
    """The paper's claims and their verdicts, as ``ppg reproduce --json`` has written them."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Build the table, and a list of definitions."""
        from benchmarks.reproduction.markdown import claims_markdown

        path = Path(__file__).parent / self.arguments[0]
        self.env.note_dependency(str(path))
        return self.parse_text_to_nodes(claims_markdown(path))


def _verb(name: str | None, command: Callable[..., None] | None) -> str:
    from benchmarks.studies.markdown import markdown_table

    assert name is not None
    assert command is not None
    parameters = inspect.signature(command, eval_str=True).parameters.values()
    table = markdown_table(("argument", "meaning", "default"), [_row(p) for p in parameters])
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


def setup(app: Any) -> dict[str, bool]:
    """Register the directives."""
    app.add_directive("scenarios", Scenarios)
    app.add_directive("commands", Commands)
    app.add_directive("study", StudyResults)
    app.add_directive("claims", Claims)
    return {"parallel_read_safe": True}
