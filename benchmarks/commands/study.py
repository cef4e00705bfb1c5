"""``ppg study``: experiments reported with tables, a figure and sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.interrupt import keep
from benchmarks.options import (
    CollisionsOption,
    JobsOption,
    JsonOption,
    SeedOption,
    number_list,
    with_group,
)
from benchmarks.terminal import PIPE_WIDTH, bar, print_json, print_table

if TYPE_CHECKING:
    from benchmarks.studies.study import Study, StudyChoice


@dataclass(frozen=True)
class Paths:
    """Files that a study reads and writes."""

    results: Annotated[
        str | None,
        typer.Option(
            metavar="JSON",
            help="File of rows; stored rows are not run again (default out/STUDY.json).",
        ),
    ] = None
    store: Annotated[
        str | None,
        typer.Option(
            metavar="DB",
            help="Sweep store of whole rows, with plans (default out/studies.db).",
        ),
    ] = None
    out: Annotated[
        str | None,
        typer.Option(
            metavar="PNG", help="Figure; STEM-<part>.png if several (default out/STUDY.png)."
        ),
    ] = None


@dataclass(frozen=True)
class Range:
    """What a study ranges over."""

    scenarios: Annotated[str | None, typer.Option(help="Scenarios of the study, by name.")] = None
    speeds: Annotated[
        str | None, typer.Option(metavar="l1,disc,box", help="Speed sets (default: the study's).")
    ] = None
    lams: Annotated[
        str | None, typer.Option(metavar="L,L,...", help="Values of lam (default: the study's).")
    ] = None
    episodes: Annotated[
        int | None,
        typer.Option(min=10, help="Episodes of each player in each cell (default: the study's)."),
    ] = None
    collisions: CollisionsOption = "instants"


@with_group("paths", Paths)
@with_group("chosen", Range)
def study(
    name: Annotated[str, typer.Argument(metavar="STUDY", help="Which study; see the docs.")],
    *,
    paths: Paths,
    chosen: Range,
    jobs: JobsOption = 1,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Run a study, or continue it, and report what its rows say."""
    from benchmarks.figures import picture_target
    from benchmarks.output_paths import own_folder, target
    from benchmarks.studies.registry import find_study

    experiment = find_study(name)
    choice = _choice(experiment, chosen, seed)
    results = Path(target(name, paths.results, ".json"))
    store = Path(target("studies", paths.store, ".db"))
    picture = picture_target(name, paths.out, as_json=as_json)
    own_folder(str(results))
    own_folder(str(store))
    keep(f"rows in {store} are kept, and the same command continues from them")
    with bar(f"study {name}", len(experiment.cells(choice))) as advance:
        rows = experiment.rows(choice, results, store, jobs=jobs, progress=advance)
    sentences = list(experiment.words(rows))
    if as_json:
        print_json({"study": name, "rows": rows, "words": sentences})
    else:
        _print(experiment, rows, sentences)
    if picture is not None:
        _draw(experiment, rows, picture)


def _choice(experiment: Study, chosen: Range, seed: int) -> StudyChoice:
    """Narrow or widen the study to what was chosen."""
    from benchmarks.studies.study import SPEEDS

    whole = experiment.choice
    known = tuple(dict.fromkeys((*whole.scenarios, *experiment.more)))
    return replace(
        whole,
        scenarios=_names("--scenarios", chosen.scenarios, known) or whole.scenarios,
        speeds=_names("--speeds", chosen.speeds, SPEEDS) or whole.speeds,
        lams=whole.lams if chosen.lams is None else tuple(number_list("lams", chosen.lams)),
        episodes=chosen.episodes or whole.episodes,
        seed=seed,
        collisions=chosen.collisions,
    )


def _print(experiment: Study, rows: Sequence[Any], sentences: Sequence[str]) -> None:
    for table in experiment.tables(rows):
        print_table(table.title, table.columns, table.lines, table.note, table.texts)
    for sentence in sentences:
        typer.echo(fill(sentence, PIPE_WIDTH, initial_indent="- ", subsequent_indent="  "))


def _draw(experiment: Study, rows: Sequence[Any], picture: str) -> None:
    from benchmarks.figures import write_figure
    from benchmarks.output_paths import own_folder

    own_folder(picture)
    for part, figure in experiment.draw(rows).items():
        whole = Path(picture)
        file = str(whole.with_name(f"{whole.stem}-{part}{whole.suffix}")) if part else picture
        write_figure(figure, file)
        typer.echo(f"picture: {file}", err=True)


def _names(option: str, text: str | None, known: Sequence[str]) -> tuple[str, ...]:
    """Return the names in ``text``; each must be ``known``."""
    from ppg_env.errors import require

    names = tuple(text.split(",")) if text is not None else ()
    for name in names:
        require(name in known, option, f"has {name!r}", "use names of " + ", ".join(known))
    return names
