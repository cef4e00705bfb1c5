"""``ppg regret``: how far from equilibrium a player is in the environment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    GameArgument,
    JsonOption,
    ToleranceOption,
    named_game,
    with_game_options,
    with_planner_options,
)
from benchmarks.terminal import interval, no_solution, print_json, print_table, working
from solvers.planner_options import PlannerOptions

if TYPE_CHECKING:
    from baselines.regret import RegretBound
    from ppg_env.env.players import Player
    from ppg_env.game.game import Game


@with_game_options
@with_planner_options("solver", "time_limit", "seed", time_limit=300.0)
def regret(
    game: GameArgument,
    *,
    player: Annotated[str, typer.Option(help="The player: a name, or a learner's file.")] = (
        "ppo-selfish"
    ),
    run: Annotated[int, typer.Option(min=0, help="Which training run of a learner.")] = 0,
    deviation: Annotated[
        str | None,
        typer.Option(
            metavar="grid,planned,trained",
            help="Deviations to look for: dynamic programming on a grid, the planner, PPO "
            "(default: grid and planned where a grid applies, else planned and trained).",
        ),
    ] = None,
    steps: Annotated[
        int, typer.Option(min=1, help="Steps to train a deviation with PPO.")
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
    """Bound regret: what each agent gains by the best deviation found, and at most."""
    from baselines.deviations import DeviationOptions, check_deviation, usual_deviations
    from baselines.regret import regret_bounds
    from benchmarks.comparison.players import chosen_player
    from ppg_env.env.rules import Rules

    name, _ = chosen_player(player)
    instance = named_game(game, overrides)
    names = usual_deviations(instance) if deviation is None else tuple(deviation.split(","))
    for each in names:
        check_deviation(each, "--deviation")
    if "trained" in names:
        from baselines.train import require_extra

        require_extra()
    with working(f"regret of {name} in {game}") as status:
        players = _players(name, instance, run, planner)
        status.update(f"looking for deviations from {name} in {game}")
        options = DeviationOptions(steps, planner.seed, planner.solver, planner.time_limit)
        bounds = regret_bounds(
            instance,
            players,
            deviations=names,
            episodes=episodes,
            seed=planner.seed,
            rules=Rules(tolerance=tolerance),
            options=options,
        )
    if as_json:
        print_json(_report(instance, name, run, bounds))
    else:
        _print(instance, name, episodes, names, bounds)


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
            "cost": vars(bound.cost),
            "regret": vars(bound.regret),
            "at_most": bound.most,
            "deviation": bound.deviation,
            "gains": {kind: vars(gain) for kind, gain in bound.gains.items()},
        }
        for i, bound in bounds.items()
    ]
    return {"scenario": game_name(game), "player": name, "run": run, "agents": agents}


def _print(
    game: Game,
    name: str,
    episodes: int,
    deviations: tuple[str, ...],
    bounds: dict[int, RegretBound],
) -> None:
    from benchmarks.comparison.report import game_name

    rows = []
    for i, bound in bounds.items():
        gains = [bound.gains.get(kind) for kind in deviations]
        shown = ["" if gain is None else interval(gain, ".3f", ".3f") for gain in gains]
        regret = interval(bound.regret, ".3f", ".3f")
        rows.append((game.agent_names[i], bound.deviation, regret, f"{bound.most:.3f}", *shown))
    print_table(
        f"{name} in {game_name(game)}: regret in the environment",
        ("agent", "deviation", "regret from", "to", *(f"gain {kind}" for kind in deviations)),
        rows,
        f"Gains in expected cost; {episodes:,} episodes; 95 % intervals; see ppg explain regret.",
        texts=2,
    )
