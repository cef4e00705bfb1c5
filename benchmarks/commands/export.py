"""``ppg export``: trajectories as a table, for pandas and spreadsheets."""

from __future__ import annotations

from typing import Annotated

import typer

from benchmarks.options import JsonOption, PlanArgument, SeedOption
from benchmarks.terminal import print_json


def export(
    plan: PlanArgument,
    *,
    out: Annotated[
        str, typer.Option(metavar="CSV", help="Where to write the table.")
    ] = "trajectory.csv",
    episodes: Annotated[
        int | None,
        typer.Option(
            min=1, help="Export the states of this many simulated episodes instead of the means."
        ),
    ] = None,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Write a plan's trajectories to a CSV file: one row per agent and time."""
    from benchmarks.comparison import trajectory_tables as tables
    from ppg_env.env.episodes import trajectories
    from ppg_env.env.players import Tracker
    from ppg_env.formats.csv_text import csv_text
    from ppg_env.formats.plan_file import read_plan
    from ppg_env.support.atomic_write import check_target, write_atomically

    check_target(out, ".csv")
    game, profile, _ = read_plan(plan)
    if episodes is None:
        columns, rows = tables.plan_columns(game), list(tables.plan_rows(game, profile))
    else:
        players = [Tracker(game, i, planned) for i, planned in enumerate(profile)]
        states = trajectories(game, players, episodes, seed)
        columns, rows = tables.episode_columns(game), list(tables.episode_rows(game, states))
    write_atomically(out, csv_text(columns, rows))
    if as_json:
        print_json({"path": out, "rows": len(rows), "columns": columns})
    else:
        typer.echo(f"wrote {out}: {len(rows):,} rows", err=True)
