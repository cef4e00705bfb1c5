"""``ppg show``: a game in full."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import GameArgument, JsonOption, SeedOption, with_game_options
from benchmarks.terminal import print_json, print_table

if TYPE_CHECKING:
    from ppg_env.game.agent import Agent
    from ppg_env.game.game import Game

COLUMNS = (
    "agent",
    "start",
    "goal",
    "lam",
    "speed set",
    "corners",
    "spectral radius",
    "earliest arrival",
)


@with_game_options
def show(
    game: GameArgument,
    *,
    out: Annotated[str | None, typer.Option(help="Write the game to this .toml file.")] = None,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
    overrides: dict[str, Any],
) -> None:
    """Show a game: its agents, obstacles and weights; write it as a TOML file."""
    from ppg_env.formats.game_file import game_to_tables, game_to_toml
    from ppg_env.scenarios.make import make_game
    from ppg_env.support.atomic_write import check_target, write_atomically

    instance = make_game(game, **overrides)
    if out is not None:
        check_target(out, ".toml")
        write_atomically(out, game_to_toml(instance))
        typer.echo(f"wrote {out}", err=True)
    if as_json:
        print_json(game_to_tables(instance))
        return
    _print(instance, game)


def _print(game: Game, call: str) -> None:
    print_table(
        f"{game.name or call}: {len(game.agents)} agents, {len(game.obstacles)} obstacles",
        COLUMNS,
        [_cells(game, i) for i in range(len(game.agents))],
        f"horizon {game.horizon}, objective {game.objective}, margin cap {game.margin_cap:g}, "
        f"crash cost {game.crash_cost:g}",
    )


def _cells(game: Game, i: int) -> tuple[str, ...]:
    from ppg_env.game.reachability import earliest_arrival

    agent = game.agents[i]
    earliest = earliest_arrival(agent, game.horizon)
    return (
        game.agent_names[i],
        _vector(agent.start),
        _vector(agent.goal),
        f"{agent.lam:g}",
        _speed_sets(agent),
        str(len(agent.shape.vertices)),
        f"{agent.spectral_radius:.3g}",
        "unreachable" if earliest is None else str(earliest),
    )


def _speed_sets(agent: Agent) -> str:
    """Return the kind of the set; if it changes, also from when on and its size."""
    from ppg_env.game.input_sets import pieces

    sets = pieces(agent.control)
    if len(sets) == 1:
        return sets[0][1].kind
    return ", ".join(
        (f"from {first} " if first else "") + f"{control.kind} {abs(control.vertices).max():g}"
        for first, control in sets
    )


def _vector(values: Any) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
