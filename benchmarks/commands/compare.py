"""``ppg compare``: players side by side in one game."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    ArenaOption,
    GameArgument,
    JsonOption,
    ToleranceOption,
    WorkersOption,
    named_game,
    with_game_options,
    with_group,
    with_planner_options,
)
from benchmarks.terminal import NO_SOLUTION, no_solution, print_json, working
from solvers.planner_options import PlannerOptions

if TYPE_CHECKING:
    from benchmarks.comparison.results import PlayerResult
    from ppg_env.game.game import Game


@dataclass(frozen=True)
class Comparison:
    """What is compared, and how it is simulated."""

    players: Annotated[str, typer.Option(help="Players, by name.")] = (
        "nash,potential,social,straight"
    )
    episodes: Annotated[int, typer.Option(min=1, help="Simulated episodes per player.")] = 200_000
    arena: ArenaOption = None
    tolerance: ToleranceOption = None


@with_game_options
@with_planner_options("solver", "time_limit", "seed")
@with_group("comparison", Comparison)
def compare(
    game: GameArgument,
    *,
    comparison: Comparison,
    out: Annotated[
        str | None, typer.Option(metavar="PICTURE", help="Picture (default out/compare-GAME.png).")
    ] = None,
    workers: WorkersOption = 1,
    planner: PlannerOptions,
    as_json: JsonOption = False,
    overrides: dict[str, Any],
) -> None:
    """Compare players in one game: arrival, cost, safety, and crashes from simulation."""
    from benchmarks.comparison.compare import compare as run
    from benchmarks.comparison.players import check_arena, chosen_players, refuse_unused
    from benchmarks.comparison.report import game_name
    from benchmarks.comparison.results import comparison_report
    from benchmarks.comparison.table import print_results
    from benchmarks.figures import picture_target
    from ppg_env.errors import require

    check_arena(comparison.arena)
    names, arena = chosen_players(comparison.players, comparison.arena)
    refuse_unused(planner, names)
    tolerance, episodes = comparison.tolerance, comparison.episodes
    unused = tolerance is not None and arena != "env"
    require(not unused, "--tolerance", "has no effect on schedule", "add --arena env")
    instance = named_game(game, overrides)
    picture = picture_target(f"compare-{game_name(instance)}", out, as_json=as_json)
    with working(f"comparing in {game}") as status:
        rows = run(
            instance,
            names,
            episodes,
            planner,
            arena=arena,
            tolerance=tolerance,
            workers=workers,
            progress=lambda player: status.update(f"{player} in {game}"),
        )
    if as_json:
        print_json(comparison_report(instance, rows, arena, episodes, planner.seed, tolerance))
    _require_a_plan(rows, as_json)
    if not as_json:
        print_results(instance, rows, arena, episodes, tolerance)
    if picture is not None:
        _draw(instance, rows, picture)


def _require_a_plan(rows: list[PlayerResult], as_json: bool) -> None:
    """Exit with code 3 if no player has a plan."""
    if any(row.played is not None for row in rows):
        return
    if as_json:
        raise typer.Exit(NO_SOLUTION)
    no_solution(rows[0].advice)


def _draw(game: Game, rows: list[PlayerResult], picture: str) -> None:
    from benchmarks.comparison.pictures import comparison_picture
    from benchmarks.output_paths import own_folder

    own_folder(picture)
    comparison_picture(game, rows, picture)
    typer.echo(f"picture: {picture}", err=True)
