"""``ppg sweep``: any game fields, players and seeds, into a store that is gone on with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import JsonOption, SolverOption, TimeLimitOption, with_game_options
from benchmarks.terminal import NO_SOLUTION, bar, print_json

if TYPE_CHECKING:
    from benchmarks.sweeps import Cell, Row
    from benchmarks.sweeps.grid import Grid


@with_game_options
def sweep(
    overrides: dict[str, Any],
    games: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="GAME...|PLAN.toml", help="Scenarios and game files, or the file of a sweep."
        ),
    ] = None,
    values: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=V,V,...", help="Values of a field; repeat for more."),
    ] = None,
    players: Annotated[
        str | None, typer.Option(help="Players, by name (default nash,potential,social,straight).")
    ] = None,
    starts: Annotated[str | None, typer.Option(help="First profiles of nash.")] = None,
    orders: Annotated[str | None, typer.Option(help="Orders of moves of nash.")] = None,
    charges: Annotated[
        str | None, typer.Option(metavar="RULE,...", help="Rules of liability of nash.")
    ] = None,
    seeds: Annotated[
        str | None, typer.Option("--seeds", "--seed", help="0:5 for 0 to 4, or 1,4 (default 0).")
    ] = None,
    episodes: Annotated[
        int | None, typer.Option(min=1, help="Episodes of each cell (default 10,000).")
    ] = None,
    arena: Annotated[
        str | None,
        typer.Option(
            metavar="schedule|env", help="As for compare (default: if a player needs it)."
        ),
    ] = None,
    groups: Annotated[
        int | None,
        typer.Option(min=1, help="Groups of episodes in env; as many as runs, for equal noise."),
    ] = None,
    store: Annotated[
        str | None,
        typer.Option(metavar="DB", help="Where rows are kept (default out/sweep.db)."),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Processes; results do not depend on them.")] = 1,
    backend: Annotated[
        str, typer.Option(metavar="loky|dask|ray", help="This machine, or a cluster.")
    ] = "loky",
    shard: Annotated[
        str, typer.Option(metavar="I/N", help="Run the I-th of N equal parts only.")
    ] = "1/1",
    retry: Annotated[
        bool, typer.Option("--retry", help="Run cells again that have failed before.")
    ] = False,
    merge: Annotated[
        list[str] | None,
        typer.Option(metavar="DB", help="Take over the rows of this store first; repeatable."),
    ] = None,
    export: Annotated[
        str | None,
        typer.Option(metavar="CSV|PARQUET", help="Write all rows of the store to this file."),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say how many cells are stored and missing.")
    ] = False,
    solver: SolverOption = "ENGINE",
    time_limit: TimeLimitOption = None,
    node_limit: Annotated[
        int | None,
        typer.Option(min=1, help="Linear programs for social and potential, machine-independent."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run every combination of games, fields, players and seeds, or go on with it."""
    from benchmarks.output_paths import own_folder, target
    from benchmarks.sweeps import Store
    from benchmarks.sweeps import sweep as run
    from benchmarks.sweeps.export import check_export
    from benchmarks.sweeps.grid import whole_numbers
    from benchmarks.sweeps.run import missing, part
    from benchmarks.sweeps.summary import print_rows
    from ppg_env.errors import require
    from solvers.dispatch import check_solver

    words = {
        "players": players and _split(players),
        "starts": starts and _split(starts),
        "orders": orders and _split(orders),
        "charges": charges and _split(charges),
        "seeds": None if seeds is None else whole_numbers("--seeds", seeds),
        "arena": arena,
        "episodes": episodes,
        "groups": groups,
        "solver": None if solver == "ENGINE" else check_solver(solver),
        "time_limit": time_limit,
        "node_limit": node_limit,
    }
    given = {name: word for name, word in words.items() if word is not None}
    grid = _grid(games or [], overrides, values or [], given)
    cells = part(grid.cells(), *_shard(shard))
    path = Path(target("sweep", ".db", store))
    if export is not None:
        check_export(export)
    require(bool(games or merge or export), "GAME", "is missing", "name games, or a sweep's file")
    own_folder(str(path))
    distinct = len({cell.address for cell in cells})
    if dry_run:
        _print_missing(cells, distinct, path, retry, as_json)
        return
    with Store(path) as base:
        for other in merge or []:
            base.merge(other)
        before = distinct - len(missing(cells, base, retry=retry))
    with bar("sweep", distinct) as advance:
        rows = run(cells, path, jobs=jobs, backend=backend, retry=retry, progress=advance)
    if export is not None:
        with Store(path) as base:
            base.export(export)
        typer.echo(f"wrote {export}", err=True)
    failed = {row.address: row for row in rows if row.failed}
    if as_json:
        print_json(
            {
                "store": str(path),
                "cells": distinct,
                "stored": before,
                "ran": distinct - before,
                "failed": len(failed),
                "rows": [_report(row) for row in rows],
            }
        )
    elif rows:
        print_rows(rows)
    if failed:
        why = str(next(iter(failed.values())).reason).rstrip(".")
        typer.echo(
            f"ppg: {len(failed)} of {distinct} cells have no result, the first because: {why}. "
            "They are rows with their reasons; --retry runs them again.",
            err=True,
        )
        raise typer.Exit(NO_SOLUTION)


def _print_missing(
    cells: Sequence[Cell], distinct: int, path: Path, retry: bool, as_json: bool
) -> None:
    from benchmarks.sweeps import Store
    from benchmarks.sweeps.run import missing

    lacking = distinct
    if path.exists():
        with Store(path) as base:
            lacking = len(missing(cells, base, retry=retry))
    if as_json:
        print_json({"cells": distinct, "stored": distinct - lacking, "missing": lacking})
    else:
        typer.echo(f"{distinct} cells, {distinct - lacking} stored, {lacking} to be run")


def _split(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(","))


def _shard(text: str) -> tuple[int, int]:
    """The two numbers of ``1/4``."""
    from ppg_env.errors import InputError

    try:
        index, count = map(int, text.split("/"))
    except ValueError:
        raise InputError("--shard", f"is {text!r}", "write i/n, such as 1/4") from None
    return index, count


def _grid(
    games: Sequence[str], overrides: dict[str, Any], values: Sequence[str], words: dict[str, Any]
) -> Grid:
    """Of a sweep's file, which then says everything, or of the options."""
    from benchmarks.sweeps.grid import Grid, field_values, is_grid, read_grid
    from ppg_env.errors import require

    for game in games:
        if is_grid(game):
            alone = len(games) == 1 and not (overrides or values or words)
            require(alone, game, "describes a whole sweep", "write further wishes into the file")
            return read_grid(game)
    listed = {name: [value] for name, value in overrides.items()}
    for name, found in map(field_values, values):
        require(name not in listed, "--set", f"gives {name} again", "list all values once")
        listed[name] = found
    return Grid(tuple(games), listed, **words)


def _report(row: Row) -> dict[str, Any]:
    """A row without its game and plans."""
    from benchmarks.sweeps.row import COLUMNS, PACKED

    return {name: getattr(row, name) for name, kind in COLUMNS.items() if kind not in PACKED}
