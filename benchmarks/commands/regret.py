"""``ppg regret``: how far from equilibrium a player is in the environment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    GameArgument,
    JsonOption,
    ToleranceOption,
    with_game_options,
    with_planner_options,
)
from benchmarks.terminal import interval, no_solution, print_json, print_table, working
from solvers.planner_options import PlannerOptions

if TYPE_CHECKING:
    from baselines.regret import RegretBound
    from ppg_env.env.players import Player
    from ppg_env.game.game import Game

KINDS = ("trained", "planned")


@with_game_options
@with_planner_options("solver", "time_limit", "seed", time_limit=60.0)
def regret(
    game: GameArgument,
    *,
    player: Annotated[str, typer.Option(help="The player: a name, or a learner's file.")] = (
        "ppo-selfish"
    ),
    run: Annotated[int, typer.Option(min=0, help="Which training run of a learner.")] = 0,
    steps: Annotated[
        int, typer.Option(min=0, help="Steps to train each deviation; 0: the planner's alone.")
    ] = 500_000,
    episodes: Annotated[
        int,
        typer.Option(min=100, help="Episodes to choose a deviation in, and to evaluate it."),
    ] = 50_000,
    tolerance: ToleranceOption = None,
    planner: PlannerOptions,
    as_json: JsonOption = False,
    overrides: dict[str, Any],
) -> None:
    """Bound regret from below: what each agent gains by the best deviation that is found."""
    from baselines.regret import regret_bounds
    from baselines.train import require_extra
    from benchmarks.comparison.players import chosen_player
    from ppg_env.scenarios.make import make_game

    name, _ = chosen_player(player)
    if steps:
        require_extra()
    instance = make_game(game, **overrides)
    with working(f"regret of {name} in {game}") as status:
        players = _players(name, instance, run, planner)
        status.update(f"looking for deviations from {name} in {game}")
        bounds = regret_bounds(
            instance,
            players,
            steps=steps,
            episodes=episodes,
            seed=planner.seed,
            solver=planner.solver,
            time_limit=planner.time_limit,
            tolerance=tolerance,
        )
    if as_json:
        print_json(_report(instance, name, run, bounds))
    else:
        _print(instance, name, episodes, bounds)


def _players(name: str, game: Game, run: int, planner: PlannerOptions) -> list[Player]:
    """Return the players of the chosen run."""
    from benchmarks.comparison.players import entrant
    from ppg_env.errors import require

    ready = entrant(name, game, planner)
    runs = ready.policies(game, planner)
    if not runs:
        no_solution(ready.solution.advice if ready.solution else "there is nothing to play")
    require(run < len(runs), "--run", f"is {run} of {len(runs)}", "count runs from 0")
    return list(runs[run])


def _report(game: Game, name: str, run: int, bounds: dict[int, RegretBound]) -> dict[str, Any]:
    from benchmarks.comparison.report import game_name

    agents = [
        {
            "agent": game.agent_names[i],
            "regret": vars(bound.regret),
            "deviation": bound.deviation,
            "gains": {kind: vars(gain) for kind, gain in bound.gains.items()},
        }
        for i, bound in bounds.items()
    ]
    return {"scenario": game_name(game), "player": name, "run": run, "agents": agents}


def _print(game: Game, name: str, episodes: int, bounds: dict[int, RegretBound]) -> None:
    from benchmarks.comparison.report import game_name

    rows = []
    for i, bound in bounds.items():
        gains = [bound.gains.get(kind) for kind in KINDS]
        shown = ["" if gain is None else interval(gain, ".3f", ".3f") for gain in gains]
        regret = interval(bound.regret, ".3f", ".3f")
        rows.append((game.agent_names[i], bound.deviation, regret, *shown))
    print_table(
        f"{name} in {game_name(game)}: regret, estimated from below",
        ("agent", "deviation", "regret from", *(f"gain {kind}" for kind in KINDS)),
        rows,
        f"Gains in expected cost; {episodes:,} episodes; 95 % intervals; see ppg explain regret.",
        texts=2,
    )
