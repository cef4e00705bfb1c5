"""The report of ``ppg reproduce``: one self-contained HTML page.

``page.html`` is its template, ``page.css`` its style and ``explorer.js`` its script.
:mod:`~benchmarks.reproduction.sections` writes the sections, and
:mod:`~benchmarks.reproduction.explorer` the data of the explorer.
"""

from __future__ import annotations

from pathlib import Path
from string import Template

from benchmarks.comparison.page_parts import embedded, with_drawing
from benchmarks.reproduction import sections
from benchmarks.reproduction.explorer import explorer_data
from benchmarks.reproduction.run import Reproduction
from ppg_env.formats.plan_file import to_json
from ppg_env.support.atomic_write import write_atomically

FOLDER = Path(__file__).parent


def write_page(reproduction: Reproduction, path: str) -> None:
    """Write the report of ``reproduction`` to ``path``.

    Raises
    ------
    InputError
        If the file cannot be written, or matplotlib is not installed.
    """
    write_atomically(path, page(reproduction))


def page(reproduction: Reproduction) -> str:
    """Return the whole page as text."""
    return Template(_part("page.html")).substitute(
        style=_part("page.css"),
        script=with_drawing(FOLDER / "explorer.js"),
        event=reproduction.extent.crash_event,
        data=embedded(to_json(explorer_data(reproduction))),
        claims=sections.claims(reproduction),
        figures=sections.figures(reproduction),
        numbers=sections.numbers(reproduction),
        failures=sections.failures(reproduction),
        making=sections.making(reproduction),
    )


def _part(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
