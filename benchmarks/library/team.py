"""Players of a game: those that track recorded plans, and those of ``ppg compare``."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.library.instance import Instance
from benchmarks.library.judge import profile_of
from benchmarks.library.record import TRACKED
from ppg_env.env.players import Player, straight_players, track
from ppg_env.errors import require

RECORDED = (*TRACKED, "straight")
"""Players that need no planning."""


def teams(instance: Instance, name: str, limit: float | None = None) -> list[Sequence[Player]]:
    """Return the players of each run of ``name``; none if a plan is not known.

    Parameters
    ----------
    name : one of :data:`RECORDED`, another player of ``ppg compare``, or a file of one.
    limit : seconds for planning or dynamic programming.

    Raises
    ------
    InputError
        If the game has no such player.
    """
    if name == "straight":
        return [straight_players(instance.game)]
    if name in TRACKED:
        entry = instance.record.tracked(name)
        return [] if entry is None else [track(instance.game, profile_of(instance, entry["plan"]))]
    from benchmarks.comparison.players import entrant
    from solvers.planner_options import PlannerOptions

    options = PlannerOptions(time_limit=limit)
    return entrant(name, instance.game, options).policies(instance.game, options)


def check_player(name: str) -> None:
    """Refuse a name that is neither a player's nor that of a file of players.

    Raises
    ------
    InputError
        With the names of players.
    """
    from benchmarks.comparison.players import FILE, PLAYERS

    others = [key for key in PLAYERS if key not in RECORDED]
    require(
        name in RECORDED or name in others or name.endswith(FILE),
        "--players",
        f"has {name!r:.60}",
        "write names of " + ", ".join([*RECORDED, *others]) + f", or files ending in {FILE}",
    )
