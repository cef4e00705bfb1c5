"""``ppg library``: games with known answers, their records, and runs of solvers over them."""

from __future__ import annotations

import typer

from benchmarks.commands.library_games import list_games, show
from benchmarks.commands.library_plans import check, submit
from benchmarks.commands.library_players import play
from benchmarks.commands.library_runs import report, run
from benchmarks.commands.library_tracks import track

library = typer.Typer(
    name="library",
    help="Games with known answers: list, run solvers and players, check and submit plans.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
library.command("list")(list_games)
for _command in (show, run, check, submit, play, track, report):
    library.command()(_command)
