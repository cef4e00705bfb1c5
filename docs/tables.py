"""Directives whose content comes from the program itself.

``{scenarios}`` is a table of the registered scenarios, ``{commands}`` a section for each verb of
``ppg`` with its arguments and options.  ``{study} NAME PART`` is what the stored results of a study
say, ``studies/NAME.json``; PART is ``question``, ``words`` or ``tables``.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
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


class StudyResults(SphinxDirective):
    """What the stored results of a study say; nothing is run, and no number is typed."""

    required_arguments = 2

    def run(self) -> list[nodes.Node]:
        """Build the part that is asked for."""
        name, part = self.arguments
        path = Path(__file__).parent / "studies" / f"{name}.json"
        self.env.note_dependency(str(path))
        return self.parse_text_to_nodes(study_part(path, name, part))


def study_part(path: Path, name: str, part: str) -> str:
    """The ``question``, the ``words`` or the ``tables`` of a study, in Markdown."""
    from benchmarks.experiments.results import read_rows
    from benchmarks.experiments.study import find_study

    study, rows = find_study(name), read_rows(path, name)
    parts: dict[str, Callable[[], list[str]]] = {
        "question": lambda: [f"*{study.question}*"],
        "words": lambda: [f"- {sentence}" for sentence in study.words(rows)],
        "tables": lambda: [
            f"**{table.title}**\n\n{_table(_flat(table.columns), table.lines)}\n\n{table.note}\n"
            for table in study.tables(rows)
        ],
    }
    return "\n".join(parts[part]())


def _flat(columns: Sequence[str]) -> list[str]:
    """Heads that are broken into lines on the terminal, on one line."""
    return [column.replace("\n", " ") for column in columns]


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
    app.add_directive("study", StudyResults)
    return {"parallel_read_safe": True}
