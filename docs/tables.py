"""Directives whose content comes from the program itself.

``{scenarios}`` is a table of the registered scenarios, ``{commands}`` a section for each command of
``ppg`` with its arguments and options.  ``{study} NAME PART`` presents the stored results of a
study, ``studies/NAME.json``; PART is ``question``, ``words`` or ``tables``.  ``{claims} FILE`` is
the table of the paper's claims with the verdicts in FILE, and their definitions;
``{library-records}`` says what the records of the instance library say, ``{library-tracks}`` who
entered its learned tracks; ``{measurements} FILE`` what a suite of ``ppg bench`` has measured;
``{claims-compared} FILE FILE`` the verdicts of two runs next to each other.
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
    """Every command of ``ppg``: its description, arguments and options."""

    def run(self) -> list[nodes.Node]:
        """Build one section per command."""
        from benchmarks.cli import app

        sections = [_section(verb.name, verb.callback) for verb in app.registered_commands]
        for group in app.registered_groups:
            assert group.typer_instance is not None
            outer = group.typer_instance.info.name
            sections += [
                _section(f"{outer} {verb.name or verb.callback.__name__}", verb.callback)
                for verb in group.typer_instance.registered_commands
                if verb.callback is not None
            ]
        return self.parse_text_to_nodes("\n\n".join(sections), allow_section_headings=True)


class StudyResults(SphinxDirective):
    """A part of the stored results of a study; nothing is run."""

    required_arguments = 2

    def run(self) -> list[nodes.Node]:
        """Build the requested part."""
        from benchmarks.studies.markdown import study_markdown

        name, part = self.arguments
        path = Path(__file__).parent / "studies" / f"{name}.json"
        self.env.note_dependency(str(path))
        return self.parse_text_to_nodes(study_markdown(name, path, part))


class LibraryRecords(SphinxDirective):
    """What the records of the instance library say."""

    def run(self) -> list[nodes.Node]:
        """Build the sentences and the tables."""
        from benchmarks.library import player_summary as players
        from benchmarks.library.instance import instances
        from benchmarks.library.learned.summary import TRACK_HEADS, track_rows
        from benchmarks.library.summary import class_rows, open_rows, sentences
        from benchmarks.studies.markdown import markdown_table

        games = instances()
        classes = ("class", "games", "closed", "with an equilibrium", "best solver (score)")
        unsolved = ("open game", "agents", "best social cost", "proved bound", "gap")
        statements = (*sentences(games), *players.player_sentences(games))
        words = "\n".join(f"- {sentence}" for sentence in statements)
        tables = (
            markdown_table(classes, class_rows(games)),
            markdown_table(players.FAMILY_HEADS, players.family_rows(games)),
            markdown_table(players.PLAYER_HEADS, players.player_rows(games)),
            markdown_table(TRACK_HEADS, track_rows()),
            markdown_table(unsolved, open_rows(games)),
        )
        return self.parse_text_to_nodes("\n\n".join((words, *tables)))


class Measurements(SphinxDirective):
    """The measurements that ``ppg bench SUITE --json`` has stored in a file."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Build the table."""
        import json

        from benchmarks.studies.markdown import markdown_table

        path = Path(__file__).parent / self.arguments[0]
        self.env.note_dependency(str(path))
        stored = json.loads(path.read_text("utf-8"))
        rows = [
            (row["what"], f"{row['value']:.2g}", f"{row['target']:g}")
            for row in stored["measurements"]
        ]
        return self.parse_text_to_nodes(markdown_table(("what", "measured", "asked"), rows))


class LibraryTracks(SphinxDirective):
    """The learned tracks of the instance library, and their entries."""

    def run(self) -> list[nodes.Node]:
        """Build one table of all entries."""
        from benchmarks.library.learned.summary import ENTRY_HEADS, entry_rows
        from benchmarks.studies.markdown import markdown_table

        return self.parse_text_to_nodes(markdown_table(ENTRY_HEADS, entry_rows()))


class Claims(SphinxDirective):
    """The paper's claims and their verdicts, from the output of ``ppg reproduce --json``."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Build the table, and a list of definitions."""
        from benchmarks.reproduction.markdown import claims_markdown

        path = Path(__file__).parent / self.arguments[0]
        self.env.note_dependency(str(path))
        return self.parse_text_to_nodes(claims_markdown(path))


class ComparedClaims(SphinxDirective):
    """The verdicts of two runs of ``ppg reproduce --json`` with different rules of collisions."""

    required_arguments = 2

    def run(self) -> list[nodes.Node]:
        """Build the table, and a sentence on the claims whose verdicts differ."""
        from benchmarks.reproduction.markdown import compared_markdown

        first, second = (Path(__file__).parent / name for name in self.arguments)
        for path in (first, second):
            self.env.note_dependency(str(path))
        return self.parse_text_to_nodes(compared_markdown(first, second))


def _section(name: str | None, command: Callable[..., None] | None) -> str:
    from benchmarks.studies.markdown import markdown_table

    assert name is not None
    assert command is not None
    parameters = inspect.signature(command, eval_str=True).parameters.values()
    table = markdown_table(("argument", "meaning", "default"), [_row(p) for p in parameters])
    return f"## `ppg {name}`\n\n{inspect.getdoc(command)}\n\n{table}"


def _row(parameter: inspect.Parameter) -> tuple[str, str, str]:
    """Return a parameter's form, help and default, from its ``Annotated`` type."""
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
    app.add_directive("library-records", LibraryRecords)
    app.add_directive("measurements", Measurements)
    app.add_directive("library-tracks", LibraryTracks)
    app.add_directive("claims", Claims)
    app.add_directive("claims-compared", ComparedClaims)
    return {"parallel_read_safe": True}
