"""``ppg study``: experiments that are told with a table, a figure and words."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from textwrap import fill
from typing import Annotated

import typer

from benchmarks.options import JsonOption, SeedOption
from benchmarks.terminal import PIPE_WIDTH, bar, print_json, print_table

STUDIES = ("learned",)

NOTE = (
    "Cost: lam per step and (1 - lam) 100 for a crash, mean over agents. Crash: anybody. self*, "
    "soc.*: ppo-selfish, ppo-social. Ratio: selfish over social, planned and learned*."
)


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
    speeds: Annotated[str, typer.Option(help="Speed sets.")] = "l1,disc,box",
    lams: Annotated[str, typer.Option(help="Values of lam.")] = "0.1,0.3,0.5,0.7,0.8,0.9",
    episodes: Annotated[
        int, typer.Option(min=10, help="Episodes of each player in each cell.")
    ] = 250_000,
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Run a study, or go on with it: selfish and social players, planned and learned."""
    from benchmarks.experiments import learned
    from benchmarks.experiments.results import completed
    from benchmarks.options import numbers
    from benchmarks.targets import own_folder, target
    from ppg_env.errors import require

    require(name in STUDIES, "study", f"is {name!r}", "write " + " or ".join(STUDIES))
    asked = learned.SCENARIOS if scenarios is None else tuple(scenarios.split(","))
    for scenario in asked:
        known = scenario in learned.SCENARIOS
        choices = ", ".join(learned.SCENARIOS)
        require(known, "--scenarios", f"has {scenario!r}", f"use names of {choices}")
    sets = tuple(speeds.split(","))
    for speed in sets:
        known = speed in learned.SPEEDS
        require(known, "--speeds", f"has {speed!r}", "use names of " + ", ".join(learned.SPEEDS))
    found = numbers("lams", lams)
    grid = tuple(found) if isinstance(found, list) else (found,)
    path = Path(target(name, ".json", results))
    picture = None if as_json and out is None else target(name, ".png", out)
    own_folder(str(path))
    todo = learned.cells(asked, sets, [lam for lam in grid if lam is not None])

    def same(cell: learned.Cell, row: dict[str, object]) -> bool:
        wanted = vars(cell) | {"episodes": episodes, "seed": seed}
        return all(row.get(key) == value for key, value in wanted.items())

    with bar(f"study {name}", len(todo)) as advance:
        rows = completed(
            path,
            name,
            todo,
            partial(learned.run_cell, episodes=episodes, seed=seed),
            same,
            jobs=jobs,
            progress=advance,
        )
    said = list(learned.words(rows))
    if as_json:
        print_json({"study": name, "rows": rows, "words": said})
    else:
        for speed in sets:
            lines = learned.table(rows, speed)
            print_table(f"speed set {speed}", learned.COLUMNS, lines, NOTE)
        for sentence in said:
            typer.echo(fill(sentence, PIPE_WIDTH, initial_indent="- ", subsequent_indent="  "))
    if picture is not None:
        from benchmarks.experiments.learned_picture import draw

        own_folder(picture)
        for speed in sets:
            file = f"{picture.removesuffix('.png')}-{speed}.png"
            draw(rows, speed, file)
            typer.echo(f"picture: {file}", err=True)
