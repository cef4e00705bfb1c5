"""``ppg feedback``: feedback optimum and equilibrium of a small game, by dynamic programming."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    GameArgument,
    JsonOption,
    SeedOption,
    named_game,
    with_game_options,
    with_group,
)
from benchmarks.terminal import bar, interval, print_json, print_note, print_table

if TYPE_CHECKING:
    from ppg_env.env.episodes import Summary
    from ppg_env.game.game import Game
    from ppg_env.support.statistics import Interval
    from solvers.feedback.grid.feedback_solution import FeedbackSolution

KINDS = ("social", "nash")


@dataclass(frozen=True)
class GridOptions:
    """How policies are computed."""

    kind: Annotated[
        str,
        typer.Option(metavar="social|nash", help="Feedback optimum, or feedback equilibrium."),
    ] = "social"
    start: Annotated[
        str,
        typer.Option(
            metavar="selfish|social|swapped",
            help="Where best responses begin in each state, for nash.",
        ),
    ] = "selfish"
    step: Annotated[
        float | None,
        typer.Option(help="Distance between grid points (default: a quarter of a step)."),
    ] = None
    memory: Annotated[
        float, typer.Option(metavar="GB", help="Most memory; what is needed is known before.")
    ] = 4.0
    time_limit: Annotated[
        float | None, typer.Option(min=0.0, metavar="S", help="Seconds, after which it ends.")
    ] = None


@with_game_options
@with_group("grid", GridOptions)
def feedback(
    game: GameArgument,
    *,
    grid: GridOptions,
    certify: Annotated[
        bool,
        typer.Option("--certify", help="Simulate what each agent gains by a best response."),
    ] = False,
    episodes: Annotated[int, typer.Option(min=100, help="Simulated episodes.")] = 50_000,
    out: Annotated[
        str | None, typer.Option(metavar="NPZ", help="File of the policies, a player.")
    ] = None,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
    overrides: dict[str, Any],
) -> None:
    """Compute feedback policies of all agents, simulate them, and bound their cost from below."""
    from benchmarks.output_paths import own_folder
    from ppg_env.env.episodes import evaluate
    from ppg_env.errors import require
    from solvers.feedback.bounds.lower_bound import social_lower_bound
    from solvers.feedback.grid.policy_file import write_feedback

    require(grid.kind in KINDS, "--kind", f"is {grid.kind!r}", "write " + " or ".join(KINDS))
    instance = named_game(game, overrides)
    if out is not None:
        own_folder(out)
    solution = _solve(instance, grid)
    played = evaluate(instance, solution.players(), episodes, seed).summary()
    bound = social_lower_bound(instance) / len(instance.agents)
    gains = _gains(solution, grid, episodes, seed) if certify else None
    if out is not None:
        write_feedback(out, solution, last=True)
    if as_json:
        print_json(_report(solution, played, bound, gains))
    else:
        _print(solution, played, bound, gains, episodes)
        if out is not None:
            typer.echo(f"policies: {out}", err=True)


def _solve(game: Game, grid: GridOptions) -> FeedbackSolution:
    from ppg_env.env.rules import Rules
    from solvers.feedback.grid.dynamic_programming import feedback_equilibrium, feedback_optimum

    with bar(f"feedback {grid.kind}, stages", Rules().steps(game)) as advance:
        nash = partial(feedback_equilibrium, start=grid.start)
        solve = feedback_optimum if grid.kind == "social" else nash
        return solve(
            game,
            step=grid.step,
            memory_limit=grid.memory * 1e9,
            time_limit=grid.time_limit,
            progress=_each(advance),
        )


def _each(advance: Callable[[int], None]) -> Callable[[int, int], None]:
    """Return a function that is called after each stage and advances a bar by one."""
    return lambda _done, _total: advance(1)


def _gains(
    solution: FeedbackSolution, grid: GridOptions, episodes: int, seed: int
) -> list[Interval]:
    """Return what each agent gains by a best response on a finer grid, simulated."""
    from baselines.deviations import DeviationOptions
    from baselines.regret import regret_bounds

    game = solution.game
    with bar("best responses, stages", solution.rules.steps(game) * len(game.agents)) as advance:
        options = DeviationOptions(
            time_limit=grid.time_limit,
            memory_limit=2 * grid.memory * 1e9,  # a finer grid
            progress=_each(advance),
        )
        bounds = regret_bounds(
            game,
            solution.players(),
            deviations=["grid"],
            episodes=episodes,
            seed=seed,
            rules=solution.rules,
            options=options,
        )
    return [bound.gains["grid"] for bound in bounds.values()]


def _report(
    solution: FeedbackSolution, played: Summary, bound: float, gains: list[Interval] | None
) -> dict[str, Any]:
    from benchmarks.comparison.report import game_name
    from benchmarks.comparison.results import estimate_report

    return {
        "scenario": game_name(solution.game),
        "kind": solution.kind,
        "grid_value": solution.value,
        "step": solution.step,
        "stages": solution.stages,
        "stationary": solution.stationary,
        "without_equilibrium": solution.without_equilibrium,
        "expected_cost": [vars(cost) for cost in played.cost],
        "expected_cost_mean": vars(played.cost_mean),
        "lower_bound_mean": bound,
        "crash_probability": estimate_report(played.crash_any),
        "gain": None if gains is None else [vars(gain) for gain in gains],
        "seconds": solution.seconds,
    }


def _print(
    solution: FeedbackSolution,
    played: Summary,
    bound: float,
    gains: list[Interval] | None,
    episodes: int,
) -> None:
    from benchmarks.comparison.report import game_name

    game = solution.game
    rows = [
        (
            name,
            f"{solution.value[i]:.3f}",
            interval(played.cost[i], ".3f", ".3f"),
            interval(played.crash[i]),
            *([] if gains is None else [interval(gains[i], ".3f", ".3f")]),
        )
        for i, name in enumerate(game.agent_names)
    ]
    columns = ("agent", "grid value", "expected cost", "crash probability")
    print_table(
        f"{game_name(game)}: feedback {solution.kind}, grid step {solution.step:g}, "
        f"{solution.seconds:.0f} s",
        columns if gains is None else (*columns, "gain of a best response"),
        rows,
        f"{episodes:,} episodes in the environment; 95 % intervals; see ppg explain feedback.",
    )
    print_note(
        f"mean cost {interval(played.cost_mean, '.3f', '.3f')}; no players have less than "
        f"{bound:.3f}"
    )
    if solution.without_equilibrium:
        print_note(
            f"best responses cycle in {solution.without_equilibrium:.2%} of the states: there a "
            "pair of actions of small regret is played"
        )
