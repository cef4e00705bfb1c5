"""``ppg show``: a game in full."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import GameArgument, JsonOption, SeedOption, with_game_options
from benchmarks.terminal import print_json, print_table

if TYPE_CHECKING:
    import numpy as np

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
    "arrives within",
)

LARGEST = 10_000_000
"""Agents times the square of the horizon up to which earliest arrivals are computed: they take one
or more linear programs per agent, and up to this size a few seconds in all."""


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
    from ppg_env.env.arrival_regions import arrival_tolerances

    regions, small = arrival_tolerances(game), len(game.agents) * game.horizon**2 <= LARGEST
    note = "" if small else "\nearliest arrivals are not computed for so many agents and steps"
    print_table(
        f"{game.name or call}: {len(game.agents)} agents, {len(game.obstacles)} obstacles",
        COLUMNS,
        [
            _cells(game, i, _earliest(game, i) if small else "", _region(half))
            for i, half in enumerate(regions)
        ],
        f"horizon {game.horizon}, objective {game.objective}, margin cap {game.margin_cap:g}, "
        f"crash cost {game.crash_cost:g}, collisions {game.collisions}, on_goal {game.on_goal}"
        + note
        + "".join(f"\n{line}" for line in (*_limits(game), *_moving(game))),
    )


def _limits(game: Game) -> Iterator[str]:
    """Yield a line per agent that has a workspace, a reserve or a cost of effort."""
    for name, agent in zip(game.agent_names, game.agents, strict=True):
        parts = [
            f"within {len(region.offsets)} half-spaces of {_space(agent, region.dim)}"
            + (f", {region.sigmas:g} sigma clear" if region.sigmas else "")
            for region in agent.within
        ]
        parts += [
            f"{key} {getattr(agent, key):g}" for key in ("reserve", "effort") if getattr(agent, key)
        ]
        if parts:
            yield f"{name}: " + "; ".join(parts)


def _space(agent: Agent, dim: int) -> str:
    return "positions" if dim == agent.dim else "states"


def _moving(game: Game) -> Iterator[str]:
    """Yield a line per obstacle that moves, is uncertain or leaves."""
    for k, obstacle in enumerate(game.obstacles):
        parts = []
        if obstacle.path is not None:
            ends = (obstacle.path[0], obstacle.path[-1])
            parts.append(f"moves from {_vector(ends[0])} to {_vector(ends[1])} by {obstacle.rest}")
        if obstacle.noise.any():
            parts.append(f"noise {obstacle.noise.diagonal().max():g} per step")
        if obstacle.until is not None:
            parts.append(f"gone from {obstacle.until}")
        if parts:
            yield f"obstacle[{k}]: " + "; ".join(parts)


def _earliest(game: Game, i: int) -> str:
    from ppg_env.game.reachability import earliest_arrival

    earliest = earliest_arrival(game.agents[i], game.horizon)
    return "unreachable" if earliest is None else str(earliest)


def _cells(game: Game, i: int, earliest: str, region: str) -> tuple[str, ...]:
    agent = game.agents[i]
    return (
        game.agent_names[i],
        _vector(agent.start),
        _vector(agent.goal),
        f"{agent.lam:g}",
        _speed_sets(agent),
        str(len(agent.shape.vertices)),
        f"{agent.spectral_radius:.3g}",
        earliest,
        region,
    )


def _region(half: np.ndarray) -> str:
    """Return the half widths of an arrival region of the environment, once if all are equal."""
    return f"{half[0]:.4g}" if (half == half[0]).all() else _vector(half)


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
