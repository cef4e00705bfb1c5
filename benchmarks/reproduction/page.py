"""The report of ``ppg reproduce``: one HTML page that needs nothing else, not even a network.

``page.html`` is its skeleton, ``page.css`` its style and ``explorer.js`` its script; the parts are
filled in by :mod:`~benchmarks.reproduction.sections` and the explorer's data by
:mod:`~benchmarks.reproduction.explorer`.
"""

from __future__ import annotations

from pathlib import Path
from string import Template

from benchmarks.reproduction import sections
from benchmarks.reproduction.explorer import explorer_data
from benchmarks.reproduction.run import Reproduction
from ppg_env.formats.plan_file import to_json
from ppg_env.support.atomic_write import write_atomically

FOLDER = Path(__file__).parent


def write_page(found: Reproduction, path: str) -> None:
    """Write the report of ``found`` to ``path``.

    Raises
    ------
    InputError
        If the file cannot be written, or there is no matplotlib.
    """
    write_atomically(path, page(found))


def page(found: Reproduction) -> str:
    """The whole page as text."""
    return Template(_part("page.html")).substitute(
        style=_part("page.css"),
        script=_part("explorer.js"),
        data=embedded(to_json(explorer_data(found))),
        claims=sections.claims(found),
        figures=sections.figures(found),
        numbers=sections.numbers(found),
        failures=sections.failures(found),
        making=sections.making(found),
    )


def embedded(json: str) -> str:
    """``json`` as it may stand in a script element, which ``</script>`` or ``<!--`` would end."""
    return json.replace("<", "\\u003c")


def _part(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
