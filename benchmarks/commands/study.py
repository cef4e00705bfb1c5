"""``ppg study``: experiments that are told with a table, a figure and words."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from textwrap import fill
from typing import Annotated, Any

import typer

from benchmarks.options import JsonOption, SeedOption
from benchmarks.terminal import PIPE_WIDTH, bar, print_json, print_table

STUDIES = {
    "learned": "benchmarks.experiments.learned",
    "tightness": "benchmarks.experiments.tightness",
}
"""Modules that have the defaults of the options below in capitals, and the functions ``cells``,
``run_cell``, ``tables``, ``words`` and ``pictures``."""


def study(
    name: Annotated[str, typer.Argument(metavar="|".join(STUDIES), help="Which study.")],
    results: Annotated[
        str | None,
        typer.Option(
            metavar="JSON",
            help="Where rows are kept; those already there are not run again "
            "(default out/STUDY.json).",
        ),
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(metavar="PNG", help="Figures, STEM-<speed>.png (default out/STUDY.png)."),
    ] = None,
    scenarios: Annotated[
        str | None, typer.Option(help="Scenarios, by name (default: the paper's).")
    ] = None,
    speeds: Annotated[
        str | None, typer.Option(metavar="l1,disc,box", help="Speed sets (default: the study's).")
    ] = None,
    lams: Annotated[
        str | None, typer.Option(metavar="L,L", help="Values of lam (default: the study's).")
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(min=10, help="Episodes of each player in each cell (default: the study's)."),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Run a study, or go on with it: selfish and social players, or how tight risk bounds are."""
    from benchmarks.experiments.results import completed
    from benchmarks.options import numbers
    from benchmarks.targets import own_folder, target
    from ppg_env.errors import require

    require(name in STUDIES, "study", f"is {name!r}", "write " + " or ".join(STUDIES))
    chosen: Any = import_module(STUDIES[name])
    asked = _names("--scenarios", scenarios, chosen.SCENARIOS, chosen.SCENARIOS)
    sets = _names("--speeds", speeds, chosen.DEFAULT_SPEEDS, chosen.SPEEDS)
    found = list(chosen.LAMS) if lams is None else numbers("lams", lams)
    grid = found if isinstance(found, list) else [found]
    wanted = chosen.EPISODES if episodes is None else episodes
    path = Path(target(name, ".json", results))
    picture = None if as_json and out is None else target(name, ".png", out)
    own_folder(str(path))
    todo = chosen.cells(asked, sets, grid)

    def same(cell: Any, row: dict[str, object]) -> bool:
        fields = vars(cell) | {"episodes": wanted, "seed": seed}
        return all(row.get(key) == value for key, value in fields.items())

    with bar(f"study {name}", len(todo)) as advance:
        rows = completed(
            path,
            name,
            todo,
            partial(chosen.run_cell, episodes=wanted, seed=seed),
            same,
            jobs=jobs,
            progress=advance,
        )
    said = list(chosen.words(rows))
    if as_json:
        print_json({"study": name, "rows": rows, "words": said})
    else:
        for table in chosen.tables(rows, sets):
            print_table(table.title, table.columns, table.lines, table.note)
        for sentence in said:
            typer.echo(fill(sentence, PIPE_WIDTH, initial_indent="- ", subsequent_indent="  "))
    if picture is not None:
        own_folder(picture)
        for file in chosen.pictures(rows, sets, picture.removesuffix(".png")):
            typer.echo(f"picture: {file}", err=True)


def _names(
    option: str, text: str | None, default: Sequence[str], known: Sequence[str]
) -> tuple[str, ...]:
    """The names in ``text``, all of which are ``known``."""
    from ppg_env.errors import require

    if text is None:
        return tuple(default)
    names = tuple(text.split(","))
    for name in names:
        require(name in known, option, f"has {name!r}", "use names of " + ", ".join(known))
    return names
