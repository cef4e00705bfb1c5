"""Players of a game: those that track recorded plans, and those of ``ppg compare``."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.library.instance import Instance
from benchmarks.library.judge import profile_of
from benchmarks.library.record import TRACKED
from ppg_env.env.players import Player, straight_players, track
from ppg_env.errors import InputError, require

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
        If there is no such player of this game.
    """
    if name == "straight":
        return [straight_players(instance.game)]
    if name in TRACKED:
        entry = instance.record.tracked(name)
        return [] if entry is None else [track(instance.game, profile_of(instance, entry["plan"]))]
    from benchmarks.comparison.players import FILE, PLAYERS, entrant
    from solvers.planner_options import PlannerOptions

    require(
        name in PLAYERS or name.endswith(FILE),
        f"{name!r:.80}",
        "is not a player",
        "write " + ", ".join([*TRACKED, *(key for key in PLAYERS if key not in TRACKED)]),
    )
    options = PlannerOptions(time_limit=limit)
    return entrant(name, instance.game, options).policies(instance.game, options)


def why_not_playable(instance: Instance) -> str:
    """Return why the environment refuses a game under its default rules; empty if it does not."""
    from ppg_env.env.arrival_regions import checked_tolerances
    from ppg_env.env.rules import Rules

    try:
        checked_tolerances(instance.game, Rules())
    except InputError as error:
        return str(error)
    return ""
