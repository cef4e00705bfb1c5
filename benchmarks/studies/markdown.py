"""Stored results of a study as Markdown, for the documentation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.studies.registry import find_study
from benchmarks.studies.results import read_rows
from benchmarks.studies.study import Table
from ppg_env.errors import require


def study_markdown(name: str, path: Path, part: str) -> str:
    """Return the ``question``, ``words`` or ``tables`` of a study, from the results in ``path``.

    Raises
    ------
    InputError
        If there is no such study or part, or ``path`` does not hold its results.
    """
    study = find_study(name)
    require(path.exists(), str(path), "does not exist", f"run ppg study {name} --results {path}")
    rows = read_rows(path, name)
    parts: dict[str, Callable[[], list[str]]] = {
        "question": lambda: [f"*{study.question}*"],
        "words": lambda: [f"- {sentence}" for sentence in study.words(rows)],
        "tables": lambda: [_titled(table) for table in study.tables(rows)],
    }
    require(part in parts, "part", f"is {part!r}", "write " + " or ".join(parts))
    return "\n".join(parts[part]())


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]], texts: int = 0) -> str:
    """Return a table; with ``texts``, the columns after the first ``texts`` are right-aligned."""
    numbers = len(head) - texts if texts else 0
    rule = ["---"] * (len(head) - numbers) + ["---:"] * numbers
    escaped = [
        [cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in (head, *rows)
    ]
    lines = [escaped[0], rule, *escaped[1:]]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _titled(table: Table) -> str:
    cells = markdown_table(table.columns, table.lines, table.texts)
    return f"**{table.title}**\n\n{cells}\n\n{table.note}\n"
