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
    from benchmarks.comparison.compare import Played, PlayerResult
    from ppg_env.game.game import Game
    from ppg_env.support.statistics import Interval

SCHEDULE_COLUMNS = (
    "player",
    "sees",
    "arrival",
    "social cost",
    "regret <=",
    "crash probability",
    "risk bound",
    "expected cost",
)
ENV_COLUMNS = (
    "player",
    "sees",
    "runs",
    "arrival",
    "arrived %",
    "crash probability",
    "expected cost",
)
STARS = {
    "": "",
    "*": "* Fewer than ten crashes were counted, so the method is rare (ppg risk): weighted "
    "episodes with a crash in sight, or splitting; for learners the trainings as given.",
    "**": "** Rare, and not to be trusted: ask for more episodes.",
}
NOTES = {
    "schedule": "Social cost: sum of shifted costs. Crash: anybody, {episodes:,} episodes on "
    "schedule, 95 % intervals. Expected cost: lam T + (1 - lam) {kappa:g} Pr(crash), mean over "
    "agents. Overlap: the plan's own means collide.",
    "env": "In the environment: arrival within a region, inputs projected, crashed agents leave; "
    "{episodes:,} episodes. 95 % intervals over episodes, for learners over training runs too. "
    "Arrival: mean over episodes that arrive. Crash: anybody. Expected cost: lam per step, "
    "(1 - lam) {kappa:g} for a crash, mean over agents.",
}


@with_game_options
def compare(
    game: GameArgument,
    overrides: dict[str, Any],
    players: Annotated[
        str, typer.Option(help="Players, by name.")
    ] = "nash,potential,social,straight",
    episodes: Annotated[int, typer.Option(min=1, help="Simulated episodes per player.")] = 200_000,
    arena: Annotated[
        str | None,
        typer.Option(
            metavar="schedule|env",
            help="Plans on schedule, or the environment (default: if a player needs it).",
        ),
    ] = None,
    out: Annotated[
        str | None, typer.Option(metavar="PNG", help="Picture (default out/compare-GAME.png).")
    ] = None,
    workers: WorkersOption = 1,
    solver: SolverOption = "ENGINE",
    time_limit: TimeLimitOption = None,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Compare players in one game: arrival, cost, safety, and crashes from simulation."""
    from benchmarks.comparison.compare import compare as run
    from benchmarks.comparison.compare import comparison_report
    from benchmarks.comparison.players import ARENAS, PlannerOptions, chosen_players
    from benchmarks.comparison.report import game_name
    from benchmarks.output_paths import own_folder, target
    from ppg_env.errors import require
    from ppg_env.scenarios.make import make_game
    from solvers.dispatch import check_solver

    known = arena is None or arena in ARENAS
    require(known, "--arena", f"is {arena!r}", "write " + " or ".join(ARENAS))
    names, arena = chosen_players(players, arena)
    made = make_game(game, **overrides)
    limits = PlannerOptions(check_solver(solver), time_limit, seed)
    wanted = out is not None or not as_json
    picture = target(f"compare-{game_name(made)}", ".png", out) if wanted else None
    with working(f"comparing in {game}") as status:
        rows = run(
            made,
            names,
            episodes,
            limits,
            arena=arena,
            workers=workers,
            progress=lambda player: status.update(f"{player} in {game}"),
        )
    nobody = all(row.played is None for row in rows)
    if as_json:
        print_json(comparison_report(made, rows, arena, episodes, seed))
        if nobody:
            raise typer.Exit(NO_SOLUTION)
    elif nobody:
        no_solution(_why(rows[0]))
    else:
        _print(made, rows, arena, episodes)
    if picture is not None:
        from benchmarks.comparison.pictures import comparison_picture

        own_folder(picture)
        comparison_picture(made, rows, picture)
        typer.echo(f"picture: {picture}", err=True)


def _print(game: Game, rows: list[PlayerResult], arena: str, episodes: int) -> None:
    from benchmarks.comparison.report import game_name

    cells = _schedule_cells if arena == "schedule" else _env_cells
    heads = SCHEDULE_COLUMNS if arena == "schedule" else ENV_COLUMNS
    lines = [
        cells(row) if row.played else (row.player, _status(row), *[""] * (len(heads) - 2))
        for row in rows
    ]
    failures = [f"{row.player}: {_why(row)}." for row in rows if not row.played]
    rare = [STARS[star] for star in sorted({_star(row.played) for row in rows if row.played})]
    lams = sorted({agent.lam for agent in game.agents})
    print_table(
        f"{game_name(game)}: objective {game.objective}, lam {', '.join(f'{x:g}' for x in lams)}",
        heads,
        lines,
        " ".join([*failures, NOTES[arena].format(episodes=episodes, kappa=game.crash_cost), *rare]),
        texts=2,
    )


def _status(row: PlayerResult) -> str:
    return "" if row.solution is None else str(row.solution.status)


def _why(row: PlayerResult) -> str:
    return "" if row.solution is None else row.solution.advice


def _schedule_cells(row: PlayerResult) -> tuple[str, ...]:
    assert row.solution is not None
    judged, played, regret = row.solution.evaluation, row.played, row.solution.regret
    assert judged is not None
    assert played is not None
    overlap = "" if judged.feasible else "overlap"
    return (
        row.player,
        played.information,
        times(judged.arrival),
        overlap or f"{judged.social_cost:.4f}",
        "" if regret is None else f"{regret.max():.0e}",
        _crash(played),
        overlap or f"{judged.risk_sum_any:.1e}",
        _interval(played.expected_cost),
    )


def _env_cells(row: PlayerResult) -> tuple[str, ...]:
    played = row.played
    assert played is not None
    assert played.success is not None
    spread = played.over_runs
    return (
        row.player,
        played.information,
        str(played.runs) if spread else "",
        " ".join("-" if time != time else f"{time:.2f}" for time in played.arrival),
        " ".join(f"{100 * share.value:.1f}" for share in played.success),
        _crash(played),
        _interval(spread["expected_cost"] if spread else played.expected_cost),
    )


def _crash(played: Played) -> str:
    """With the interval over runs, where there are several and crashes were counted."""
    if played.method == "rare" or played.over_runs is None or not played.crash_any.value:
        return probability(played.crash_any) + _star(played)
    found = played.over_runs["crash_probability"]
    return f"{found.value:.2e} [{found.low:.1e}, {found.high:.1e}]"


def _star(played: Played) -> str:
    """What marks a probability that was not counted, see ``STARS``."""
    if played.method == "mc":
        return ""
    return "*" if played.crash_any.trusted else "**"


def _interval(interval: Interval) -> str:
    half = max(interval.high - interval.value, interval.value - interval.low)
    return f"{interval.value:.3f} ± {half:.3f}"
