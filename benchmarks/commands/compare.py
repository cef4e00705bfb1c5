"""``ppg compare``: players side by side in one game."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    GameArgument,
    JsonOption,
    SeedOption,
    SolverOption,
    TimeLimitOption,
    WorkersOption,
    with_game_options,
)
from benchmarks.terminal import (
    NO_SOLUTION,
    no_solution,
    print_json,
    print_table,
    probability,
    times,
    working,
)

if TYPE_CHECKING:
    from benchmarks.comparison import Interval, Row
    from ppg_env.game import Game


@with_game_options
def compare(
    game: GameArgument,
    overrides: dict[str, Any],
    players: Annotated[
        str, typer.Option(help="Players, by name.")
    ] = "nash,potential,social,straight",
    episodes: Annotated[int, typer.Option(min=1, help="Simulated episodes per player.")] = 200_000,
    out: Annotated[
        str | None, typer.Option(metavar="PNG", help="Picture (default out/compare-GAME.png).")
    ] = None,
    workers: WorkersOption = 1,
    solver: SolverOption = "HIGHS",
    time_limit: TimeLimitOption = None,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Compare players in one game: arrival, cost, safety, and crashes from simulation."""
    from benchmarks.comparison import compare as run
    from benchmarks.comparison import comparison_report
    from benchmarks.players import Limits, chosen_players
    from ppg_env.make import make_game
    from solvers.backend import check_solver

    names = chosen_players(players)
    made = make_game(game, **overrides)
    limits = Limits(check_solver(solver), time_limit, seed)
    with working(f"comparing in {game}") as status:
        rows = run(
            made,
            names,
            episodes,
            limits,
            workers=workers,
            progress=lambda player: status.update(f"{player} in {game}"),
        )
    nobody = all(row.solution.profile is None for row in rows)
    if as_json:
        print_json(comparison_report(made, rows, episodes, seed))
        if nobody:
            raise typer.Exit(NO_SOLUTION)
    elif nobody:
        no_solution(rows[0].solution.advice)
    else:
        _print(made, rows, episodes)
    if out is not None or not as_json:
        _draw(made, rows, out)


def _print(game: Game, rows: list[Row], episodes: int) -> None:
    from benchmarks.comparison import information
    from benchmarks.report import game_name

    lines = []
    for row in rows:
        judged, solution = row.solution.evaluation, row.solution
        if judged is None or row.any is None or row.expected_cost is None:
            lines.append((row.player, *[""] * 5, f"{solution.status}: {solution.advice}"))
            continue
        regret = "" if solution.regret is None else f"{solution.regret.max():.0e}"
        overlap = "" if judged.feasible else "overlap"
        lines.append(
            (
                row.player,
                times(judged.arrival),
                overlap or f"{judged.social_cost:.4f}",
                regret,
                probability(row.any),
                overlap or f"{judged.risk_sum_any:.1e}",
                f"{row.expected_cost.value:.3f} ± {_half_width(row.expected_cost):.3f}",
            )
        )
    lams = sorted({agent.lam for agent in game.agents})
    print_table(
        f"{game_name(game)}: objective {game.objective}, lam {', '.join(f'{x:g}' for x in lams)}",
        (
            "player",
            "arrival",
            "social cost",
            "regret <=",
            "crash probability",
            "risk bound",
            "expected cost",
        ),
        lines,
        f"Social cost: sum of shifted costs. Crash: anybody, {episodes:,} episodes on schedule "
        f"({information(game)}), 95 % intervals. "
        f"Expected cost: lam T + (1 - lam) {game.crash_cost:g} Pr(crash), mean over agents. "
        "Overlap: the plan's own means collide.",
    )


def _half_width(interval: Interval) -> float:
    return max(interval.high - interval.value, interval.value - interval.low)


def _draw(game: Game, rows: list[Row], out: str | None) -> None:
    import re
    from pathlib import Path

    from benchmarks.pictures import comparison_picture
    from benchmarks.report import game_name

    if out is None:
        stem = re.sub(r"[^A-Za-z0-9]+", "-", game_name(game)).strip("-")
        out = f"out/compare-{stem}.png"
    if Path(out).parent == Path("out"):  # the default folder is ours to make, others are not
        Path("out").mkdir(exist_ok=True)
    comparison_picture(game, rows, out)
    typer.echo(f"picture: {out}", err=True)
