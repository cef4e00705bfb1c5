"""``ppg sweep``: any game fields, players and seeds, into a store that can be continued."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.interrupt import keep
from benchmarks.options import (
    JobsOption,
    JsonOption,
    shard_numbers,
    with_game_options,
    with_group,
    with_planner_options,
)
from benchmarks.terminal import NO_SOLUTION, bar, print_json
from solvers.planner_options import DEFAULTS, PlannerOptions

if TYPE_CHECKING:
    from benchmarks.sweeps import Cell, Row
    from benchmarks.sweeps.grid import Grid


@dataclass(frozen=True)
class Axes:
    """What a sweep combines with the games and their fields."""

    players: Annotated[
        str | None, typer.Option(help="Players, by name (default nash,potential,social,straight).")
    ] = None
    starts: Annotated[str | None, typer.Option(help="First profiles of nash.")] = None
    orders: Annotated[str | None, typer.Option(help="Orders of moves of nash.")] = None
    charges: Annotated[
        str | None, typer.Option(metavar="RULE,...", help="Liability rules of nash.")
    ] = None
    seeds: Annotated[
        str | None, typer.Option("--seeds", "--seed", help="0:5 for 0 to 4, or 1,4 (default 0).")
    ] = None
    episodes: Annotated[
        int | None, typer.Option(min=1, help="Episodes of each cell (default 10,000).")
    ] = None
    arena: Annotated[
        str | None,
        typer.Option(
            metavar="schedule|env", help="As for compare (default: if a player needs it)."
        ),
    ] = None
    groups: Annotated[
        int | None,
        typer.Option(min=1, help="Groups of episodes in env; as many as runs, for equal noise."),
    ] = None

    def words(self) -> dict[str, Any]:
        """Return the axes that were given, as the words of a grid."""
        from benchmarks.sweeps.grid import whole_numbers

        given = {name: value for name, value in vars(self).items() if value is not None}
        for name in ("players", "starts", "orders", "charges"):
            if given.get(name):
                given[name] = tuple(part.strip() for part in given[name].split(","))
        if self.seeds is not None:
            given["seeds"] = whole_numbers("--seeds", self.seeds)
        return given


@dataclass(frozen=True)
class Run:
    """Where rows are stored, and who runs which cells."""

    store: Annotated[
        str | None,
        typer.Option(metavar="DB", help="Store of the rows (default out/sweep.db)."),
    ] = None
    jobs: JobsOption = 1
    backend: Annotated[
        str, typer.Option(metavar="loky|dask|ray", help="This machine, or a cluster.")
    ] = "loky"
    shard: Annotated[
        str, typer.Option(metavar="I/N", help="Run the I-th of N equal parts only.")
    ] = "1/1"
    retry: Annotated[
        bool, typer.Option("--retry", help="Run cells again that have failed before.")
    ] = False
    merge: Annotated[
        list[str] | None,
        typer.Option(metavar="DB", help="Copy the rows of this store first; repeatable."),
    ] = None
    export: Annotated[
        str | None,
        typer.Option(metavar="CSV|PARQUET", help="Write all rows of the store to this file."),
    ] = None
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Report how many cells are stored and missing.")
    ] = False

    def path(self) -> Path:
        """Return the store's path, checked."""
        from benchmarks.output_paths import target

        return Path(target("sweep", self.store, ".db"))


@with_game_options
@with_group("axes", Axes)
@with_group("run", Run)
@with_planner_options("solver", "time_limit", "node_limit")
def sweep(
    games: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="GAME...|PLAN.toml", help="Scenarios and game files, or the file of a sweep."
        ),
    ] = None,
    *,
    values: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=V,V,...", help="Values of a field; repeat for more."),
    ] = None,
    axes: Axes,
    run: Run,
    planner: PlannerOptions,
    as_json: JsonOption = False,
    overrides: dict[str, Any],
) -> None:
    """Run every combination of games, fields, players and seeds, or continue such a sweep."""
    from benchmarks.comparison.players import refuse_unused
    from benchmarks.output_paths import own_folder
    from benchmarks.sweeps.export import check_export
    from benchmarks.sweeps.run import part
    from ppg_env.errors import require

    given = {name: value for name, value in vars(planner).items() if value != DEFAULTS[name]}
    grid = _grid(games or [], overrides, values or [], axes.words() | given)
    cells = part(grid.cells(), *shard_numbers(run.shard))
    for start, order, charge in product(grid.starts, grid.orders, grid.charges):
        refuse_unused(replace(planner, start=start, order=order, charge=charge), grid.players)
    path = run.path()
    if run.export is not None:
        check_export(run.export)
    named = bool(games or run.merge or run.export)
    require(named, "GAME", "is missing", "name games, or a sweep's file")
    own_folder(str(path))
    if run.dry_run:
        _print_missing(cells, path, run.retry, as_json)
    else:
        _run(cells, path, run, as_json)


def _run(cells: Sequence[Cell], path: Path, run: Run, as_json: bool) -> None:
    """Run the missing cells, export, and print; exit with code 3 if a cell has no result."""
    from benchmarks.sweeps import Store
    from benchmarks.sweeps import sweep as run_cells
    from benchmarks.sweeps.run import missing
    from benchmarks.sweeps.summary import print_rows

    keep(f"rows in {path} are kept, and the same command continues from them")
    distinct = len({cell.address for cell in cells})
    with Store(path) as base:
        for other in run.merge or []:
            base.merge(other)
        stored = distinct - len(missing(cells, base, retry=run.retry))
    with bar("sweep", distinct) as advance:
        rows = run_cells(
            cells, path, jobs=run.jobs, backend=run.backend, retry=run.retry, progress=advance
        )
    if run.export is not None:
        with Store(path) as base:
            base.export(run.export)
        typer.echo(f"wrote {run.export}", err=True)
    if as_json:
        print_json(_report(path, rows, distinct, stored))
    elif rows:
        print_rows(rows)
    _report_failures(rows, distinct)


def _report(path: Path, rows: Sequence[Row], distinct: int, stored: int) -> dict[str, Any]:
    return {
        "store": str(path),
        "cells": distinct,
        "stored": stored,
        "ran": distinct - stored,
        "failed": len({row.address for row in rows if row.failed}),
        "rows": [_without_plans(row) for row in rows],
    }


def _without_plans(row: Row) -> dict[str, Any]:
    """Return a row without its game and plans."""
    from benchmarks.sweeps.row import COLUMNS, PACKED

    return {name: getattr(row, name) for name, kind in COLUMNS.items() if kind not in PACKED}


def _report_failures(rows: Sequence[Row], distinct: int) -> None:
    failed = {row.address: row for row in rows if row.failed}
    if failed:
        reason = str(next(iter(failed.values())).reason).rstrip(".")
        typer.echo(
            f"ppg: {len(failed)} of {distinct} cells have no result, the first because: {reason}. "
            "They are rows with their reasons; --retry runs them again.",
            err=True,
        )
        raise typer.Exit(NO_SOLUTION)


def _print_missing(cells: Sequence[Cell], path: Path, retry: bool, as_json: bool) -> None:
    from benchmarks.sweeps import Store
    from benchmarks.sweeps.run import missing

    distinct = lacking = len({cell.address for cell in cells})
    if path.exists():
        with Store(path) as base:
            lacking = len(missing(cells, base, retry=retry))
    if as_json:
        print_json({"cells": distinct, "stored": distinct - lacking, "missing": lacking})
    else:
        typer.echo(f"{distinct} cells, {distinct - lacking} stored, {lacking} to be run")


def _grid(
    games: Sequence[str], overrides: dict[str, Any], values: Sequence[str], words: dict[str, Any]
) -> Grid:
    """Return the grid of a sweep's file, which then says everything, or of the options."""
    from benchmarks.sweeps.grid import Grid, field_values, is_grid, read_grid
    from ppg_env.errors import require

    for game in games:
        if is_grid(game):
            alone = len(games) == 1 and not (overrides or values or words)
            require(alone, game, "describes a whole sweep", "write further options into the file")
            return read_grid(game)
    listed = {name: [value] for name, value in overrides.items()}
    for name, choices in map(field_values, values):
        require(name not in listed, "--set", f"gives {name} again", "list all values once")
        listed[name] = choices
    return Grid(tuple(games), listed, **words)
