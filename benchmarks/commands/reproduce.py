"""``ppg reproduce``: the paper's figures and claims, as a report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
from benchmarks.terminal import NO_SOLUTION, bar, print_json, print_table

if TYPE_CHECKING:
    from benchmarks.reproduction.extent import Extent
    from benchmarks.reproduction.run import Reproduction

NOTE = (
    "Cases: settings (speed set, margin cap M'), scenarios, gains K, equilibria by start and order "
    "of best response or by potential, and low and high lam, as far as a claim speaks of them. "
    "A crash is an {event}. Definitions and every case are in the report."
)


@dataclass(frozen=True)
class Range:
    """What is reproduced."""

    scenarios: Annotated[
        str | None, typer.Option(help="Scenarios, by name (default: the paper's).")
    ] = None
    settings: Annotated[
        str | None,
        typer.Option(
            metavar="SPEED:CAP,...", help="Speed sets with margin caps (default: four settings)."
        ),
    ] = None
    lams: Annotated[
        str | None, typer.Option(help="Values of lam (default: ten from 0.05 to 0.9).")
    ] = None
    episodes: Annotated[int, typer.Option(min=1, help="Simulated episodes of each cell.")] = 100_000
    collisions: CollisionsOption = "instants"

    def extent(self, seed: int) -> Extent:
        """Return the extent, with the paper's values where nothing was given."""
        from benchmarks.reproduction.extent import (
            LAMS,
            SCENARIOS,
            SETTINGS,
            Extent,
            read_settings,
        )

        return Extent(
            settings=SETTINGS if self.settings is None else read_settings(self.settings),
            scenarios=SCENARIOS if self.scenarios is None else tuple(self.scenarios.split(",")),
            lams=LAMS if self.lams is None else tuple(number_list("lams", self.lams)),
            episodes=self.episodes,
            seed=seed,
            collisions=self.collisions,
        )


@dataclass(frozen=True)
class Paths:
    """Files that are read and written."""

    store: Annotated[
        str | None,
        typer.Option(
            metavar="DB",
            help="Store of cells; stored cells are not run again (default out/reproduction.db).",
        ),
    ] = None
    out: Annotated[
        str | None, typer.Option(metavar="HTML", help="The report (default out/reproduction.html).")
    ] = None
    figures: Annotated[
        str | None,
        typer.Option(metavar="STEM", help="Also write each figure, as STEM-SPEED-CAP-K.png."),
    ] = None


@with_group("chosen", Range)
@with_group("paths", Paths)
def reproduce(
    *,
    chosen: Range,
    paths: Paths,
    jobs: JobsOption = 1,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Reproduce the paper's figures and claims: a table of verdicts, and a report to open."""
    from benchmarks.output_paths import FOLDER, own_folder, target
    from benchmarks.reproduction.run import report, reproduce
    from ppg_env.errors import require
    from ppg_env.support.atomic_write import check_target

    extent = chosen.extent(seed)
    store = Path(target("reproduction", paths.store, ".db"))
    page = None if as_json and paths.out is None else target("reproduction", paths.out, ".html")
    if paths.figures is not None:
        require(paths.figures != "", "--figures", "is empty", "write how the files' names begin")
        check_target(f"{paths.figures}.png", ".png", ours=FOLDER)
    own_folder(str(store))
    keep(f"rows in {store} are kept, and the same command continues from them")
    with bar("reproduce", extent.size) as advance:
        reproduction = reproduce(extent, store, jobs=jobs, progress=advance)
    _write(reproduction, page, paths.figures)
    if as_json:
        print_json(report(reproduction))
    else:
        _print(reproduction)
    if page is not None:
        typer.echo(f"report: {page}", err=True)
    _report_failures(reproduction)


def _write(reproduction: Reproduction, page: str | None, figures: str | None) -> None:
    """Write the report, and the figures if requested."""
    from benchmarks.figures import write_figure
    from benchmarks.output_paths import own_folder
    from benchmarks.reproduction.page import write_page
    from benchmarks.reproduction.pictures import draw

    if page is not None:
        own_folder(page)
        write_page(reproduction, page)
    if figures is not None:
        for (setting, gain), panels in reproduction.sheets.items():
            name = f"{setting.speed}-{setting.margin_cap:g}-K{gain:g}"
            figure = draw(panels, reproduction.extent.crash_event)
            write_figure(figure, f"{figures}-{name}.png")


def _print(reproduction: Reproduction) -> None:
    rows = [
        (
            finding.claim.key,
            str(finding.verdict),
            f"{finding.verdict.holding}/{finding.verdict.total}",
        )
        for finding in reproduction.findings
    ]
    note = NOTE.format(event=reproduction.extent.crash_event)
    print_table("The paper's claims", ("claim", "verdict", "cases"), rows, note, texts=2)


def _report_failures(reproduction: Reproduction) -> None:
    failed = reproduction.failed
    if failed:
        typer.echo(f"ppg: {len(failed)} cells have no result, the first: {failed[0]}.", err=True)
        raise typer.Exit(NO_SOLUTION)
