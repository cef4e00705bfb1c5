"""``ppg study``: experiments that are told with tables, a figure and words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Annotated

import typer

from benchmarks.options import JsonOption, SeedOption
from benchmarks.terminal import PIPE_WIDTH, bar, print_json, print_table


def study(
    name: Annotated[str, typer.Argument(metavar="STUDY", help="Which study; see the docs.")],
    results: Annotated[
        str | None,
        typer.Option(
            metavar="JSON",
            help="Where rows are kept; those already there are not run again "
            "(default out/STUDY.json).",
        ),
    ] = None,
    store: Annotated[
        str | None,
        typer.Option(
            metavar="DB",
            help="Sweep that keeps whole rows, with plans (default out/studies.db).",
        ),
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(
            metavar="PNG", help="Figure; STEM-<part>.png of several (default out/STUDY.png)."
        ),
    ] = None,
    scenarios: Annotated[
        str | None, typer.Option(help="Some of the study's scenarios, by name.")
    ] = None,
    speeds: Annotated[
        str | None, typer.Option(metavar="l1,disc,box", help="Speed sets (default: the study's).")
    ] = None,
    lams: Annotated[
        str | None, typer.Option(metavar="L,L,...", help="Values of lam (default: the study's).")
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(min=10, help="Episodes of each player in each cell (default: the study's)."),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Run a study, or go on with it, and tell what its rows say."""
    from benchmarks.options import numbers
    from benchmarks.output_paths import own_folder, target
    from benchmarks.studies.registry import find_study
    from benchmarks.studies.study import SPEEDS

    chosen = find_study(name)
    whole, lam = chosen.choice, numbers("lams", lams)
    asked = replace(
        whole,
        scenarios=_names("--scenarios", scenarios, whole.scenarios) or whole.scenarios,
        speeds=_names("--speeds", speeds, SPEEDS) or whole.speeds,
        lams=whole.lams if lam is None else tuple(lam) if isinstance(lam, list) else (lam,),
        episodes=episodes or whole.episodes,
        seed=seed,
    )
    path, base = Path(target(name, ".json", results)), Path(target("studies", ".db", store))
    picture = None if as_json and out is None else target(name, ".png", out)
    own_folder(str(path))
    own_folder(str(base))
    with bar(f"study {name}", len(chosen.cells(asked))) as advance:
        rows = chosen.rows(asked, path, base, jobs=jobs, progress=advance)
    said = list(chosen.words(rows))
    if as_json:
        print_json({"study": name, "rows": rows, "words": said})
    else:
        for table in chosen.tables(rows):
            print_table(table.title, table.columns, table.lines, table.note, table.texts)
        for sentence in said:
            typer.echo(fill(sentence, PIPE_WIDTH, initial_indent="- ", subsequent_indent="  "))
    if picture is not None:
        from benchmarks.figures import write_figure

        own_folder(picture)
        for part, figure in chosen.draw(rows).items():
            file = f"{picture.removesuffix('.png')}-{part}.png" if part else picture
            write_figure(figure, file)
            typer.echo(f"picture: {file}", err=True)


def _names(option: str, text: str | None, known: Sequence[str]) -> tuple[str, ...]:
    """The names in ``text``, all of which are ``known``."""
    from ppg_env.errors import require

    names = tuple(text.split(",")) if text is not None else ()
    for name in names:
        require(name in known, option, f"has {name!r}", "use names of " + ", ".join(known))
    return names
