"""``ppg warm``: compile the simulator and the crash risks ahead of their first use."""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from benchmarks.options import JsonOption, SeedOption
from benchmarks.terminal import print_json, print_table, working

if TYPE_CHECKING:
    from ppg_env.game.game import Game


def warm(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[GAME]...",
            help="Games to compile for as well: scenarios or .toml files.",
        ),
    ] = None,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Compile the simulator and the crash risks, once per installation."""
    from ppg_env.env.warm import code_folder, usual_games, warm_up
    from ppg_env.scenarios.make import make_game

    rows, started = [], perf_counter()
    games = [*usual_games(), *(make_game(name) for name in names or ())]
    with working("compiling the simulator") as status:
        for game, size in warm_up(games):
            _warm_risks(game, seed)
            rows.append((*size, perf_counter() - started))
            started = perf_counter()
            status.update(f"compiled for {size[0]} position and {size[1]} state components")
    if as_json:
        keys = "position_components", "state_components", "inputs", "seconds"
        sizes = [dict(zip(keys, row, strict=True)) for row in rows]
        print_json({"sizes": sizes, "folder": code_folder()})
        return
    print_table(
        "Machine code",
        ("position components", "state components", "inputs", "seconds"),
        [(str(d), str(n), str(m), f"{seconds:.1f}") for d, n, m, seconds in rows],
        f"Kept in {code_folder()}.",
    )


def _warm_risks(game: Game, seed: int) -> None:
    """Estimate the risks of straight plans, if there are any, from few episodes."""
    from ppg_env.game.least_effort import straight_plan
    from ppg_env.risk.importance_sampling import rare_risk
    from ppg_env.risk.monte_carlo import crash_counts

    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    profile = tuple(plan for plan in plans if plan is not None)
    if len(profile) == len(plans):
        crash_counts(game, profile, 10, seed)
        rare_risk(game, profile, 10, seed)
