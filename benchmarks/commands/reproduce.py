"""``ppg reproduce``: the paper's figures and claims, from nothing to a report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from benchmarks.options import JsonOption, SeedOption
from benchmarks.terminal import NO_SOLUTION, bar, print_json, print_table

NOTE = (
    "Cases: settings (speed set, margin cap M'), scenarios, gains K, equilibria by start and order "
    "of best response or by potential, and low and high lam, as far as a claim speaks of them. "
    "Definitions and every case are in the report."
)


def reproduce(
    scenarios: Annotated[
        str | None, typer.Option(help="Scenarios, by name (default: the paper's).")
    ] = None,
    settings: Annotated[
        str | None,
        typer.Option(
            metavar="SPEED:CAP,...", help="Speed sets with margin caps (default: four settings)."
        ),
    ] = None,
    lams: Annotated[
        str | None, typer.Option(help="Values of lam (default: ten from 0.05 to 0.9).")
    ] = None,
    episodes: Annotated[
        int, typer.Option(min=1, help="Simulated episodes of each cell.")
    ] = 100_000,
    store: Annotated[
        str | None,
        typer.Option(
            metavar="DB",
            help="Where cells are kept; those there are not run again "
            "(default out/reproduction.db).",
        ),
    ] = None,
    out: Annotated[
        str | None, typer.Option(metavar="HTML", help="The report (default out/reproduction.html).")
    ] = None,
    figures: Annotated[
        str | None,
        typer.Option(metavar="STEM", help="Write each figure, too, as STEM-SPEED-CAP-K.png."),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Processes; results do not depend on them.")] = 1,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """The paper's figures and claims, with verdicts: a table here, and a report to open."""
    from benchmarks.figures import write_figure
    from benchmarks.options import numbers
    from benchmarks.output_paths import FOLDER, own_folder, target
    from benchmarks.reproduction.extent import LAMS, SCENARIOS, SETTINGS, Extent, read_settings
    from benchmarks.reproduction.page import write_page
    from benchmarks.reproduction.pictures import draw
    from benchmarks.reproduction.run import report, reproduce
    from ppg_env.errors import require
    from ppg_env.support.atomic_write import check_target

    given = numbers("lams", lams)
    extent = Extent(
        settings=SETTINGS if settings is None else read_settings(settings),
        scenarios=SCENARIOS if scenarios is None else tuple(scenarios.split(",")),
        lams=LAMS if given is None else tuple(given) if isinstance(given, list) else (given,),
        episodes=episodes,
        seed=seed,
    )
    path = Path(target("reproduction", ".db", store))
    page = None if as_json and out is None else target("reproduction", ".html", out)
    if figures is not None:
        require(figures != "", "--figures", "is empty", "write how the files' names begin")
        check_target(f"{figures}.png", ".png", ours=FOLDER)
    own_folder(str(path))
    with bar("reproduce", extent.size) as advance:
        found = reproduce(extent, path, jobs=jobs, progress=advance)
    if page is not None:
        own_folder(page)
        write_page(found, page)
    if figures is not None:
        for (setting, gain), panels in found.sheets.items():
            name = f"{setting.speed}-{setting.margin_cap:g}-K{gain:g}"
            write_figure(draw(panels), f"{figures}-{name}.png")
    if as_json:
        print_json(report(found))
    else:
        print_table(
            "The paper's claims",
            ("claim", "verdict", "cases"),
            [
                (one.claim.key, str(one.verdict), f"{one.verdict.holding}/{one.verdict.total}")
                for one in found.findings
            ],
            NOTE,
            texts=2,
        )
    if page is not None:
        typer.echo(f"report: {page}", err=True)
    if found.failed:
        typer.echo(
            f"ppg: {len(found.failed)} cells have no result, the first: {found.failed[0]}.",
            err=True,
        )
        raise typer.Exit(NO_SOLUTION)
