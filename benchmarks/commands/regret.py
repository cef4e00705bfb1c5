"""``ppg regret``: how far from equilibrium a player is in the environment."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from benchmarks.options import (
    GameArgument,
    JsonOption,
    SeedOption,
    SolverOption,
    TimeLimitOption,
    with_game_options,
)
from benchmarks.terminal import no_solution, print_json, print_table, working


@with_game_options
def regret(
    game: GameArgument,
    overrides: dict[str, Any],
    player: Annotated[str, typer.Option(help="Who plays: a name, or a learner's file.")] = (
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
    solver: SolverOption = "ENGINE",
    time_limit: TimeLimitOption = 60.0,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Lower bounds on regret: what each agent gains by the best deviation that is found."""
    from baselines.regret import regret_bounds
    from baselines.train import require_extra
    from benchmarks.comparison.players import PlannerOptions, chosen_players, entrant
    from benchmarks.comparison.report import game_name
    from ppg_env.errors import require
    from ppg_env.scenarios.make import make_game
    from solvers.dispatch import check_solver

    (name, *others), _ = chosen_players(player, place="--player")
    require(not others, "--player", "has several names", "ask for one")
    if steps:
        require_extra()
    limits = PlannerOptions(check_solver(solver), time_limit, seed)
    made = make_game(game, **overrides)
    with working(f"regret of {name} in {game}") as status:
        one = entrant(name, made, limits)
        if not one.policies(made, limits):
            no_solution(one.solution.advice if one.solution else "there is nothing to play")
        require(run < one.runs, "--run", f"is {run} of {one.runs}", "count runs from 0")
        status.update(f"looking for deviations from {name} in {game}")
        found = regret_bounds(
            made,
            one.policies(made, limits)[run],
            steps=steps,
            episodes=episodes,
            seed=seed,
            solver=limits.solver,
            time_limit=time_limit,
        )
    if as_json:
        agents = [
            {
                "agent": made.agent_names[i],
                "regret": vars(bound.regret),
                "deviation": bound.deviation,
                "gains": {name: vars(gain) for name, gain in bound.gains.items()},
            }
            for i, bound in found.items()
        ]
        print_json({"scenario": game_name(made), "player": name, "run": run, "agents": agents})
        return
    rows = [
        (
            made.agent_names[i],
            bound.deviation,
            _shown(bound.regret),
            *(_shown(bound.gains[key]) if key in bound.gains else "" for key in KINDS),
        )
        for i, bound in found.items()
    ]
    print_table(
        f"{name} in {game_name(made)}: regret, estimated from below",
        ("agent", "deviation", "regret from", *(f"gain {key}" for key in KINDS)),
        rows,
        f"In the agent's expected cost; the others play on as they are. {episodes:,} episodes, "
        "95 % intervals. A deviation that gains nothing is not made.",
        texts=2,
    )


KINDS = ("trained", "planned")


def _shown(interval: Any) -> str:
    return f"{interval.value:.3f} [{interval.low:.3f}, {interval.high:.3f}]"
