"""Scaling: planners and their plans with more agents and longer horizons.

Two families grow with N: ``circle(n)``, where all agents meet in one place, and ``streams(n)``,
where two rows cross.  One game, ``intersection``, has longer and longer horizons.  ``nash`` is
best-response dynamics, ``social`` the optimum: proved up to five agents, with a heuristic search
and a bound for more.  The time limit of each planner is half a minute.

    seconds, gap, regret     wall time of a planner; certificates of its plans
    cost ratio, risk ratio   of ``nash`` over ``social``, as in :mod:`benchmarks.studies.prices`

Seconds, and plans at the time limit, depend on the machine: run the study alone and with one job.
The rows name the machine.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from itertools import product

from benchmarks import sweeps
from benchmarks.studies.prices import FOUND, OPTIMUM
from benchmarks.studies.results import StudyRow, grouped, largest_regret
from benchmarks.studies.study import StudyChoice

SIZES = (2, 3, 4, 6, 8, 10, 12, 16, 20)
HORIZONS = (12, 15, 20, 25, 30, 40)
LONG = "intersection"
"""The game whose horizon grows."""

LIMIT = 30.0
"""Seconds for each planner."""

PLAYERS = ("nash", OPTIMUM)
AXES = ("scenario", "family", "agents", "horizon", "speed", "lam")
"""Columns that identify games."""


def cells(choice: StudyChoice) -> list[sweeps.Cell]:
    """Return the cells: both planners in every game."""
    chosen = []
    for family, speed, lam in product(choice.scenarios, choice.speeds, choice.lams):
        fields = {"speed": speed, "objective": "risk", "lam": lam}
        games = (
            [(family, {**fields, "horizon": horizon}) for horizon in HORIZONS]
            if family == LONG
            else [(f"{family}({size})", fields) for size in SIZES]
        )
        chosen += [
            sweeps.Cell(
                scenario,
                player,
                game,
                episodes=choice.episodes,
                seed=choice.seed,
                time_limit=LIMIT,
            )
            for (scenario, game), player in product(games, PLAYERS)
        ]
    return chosen


def digest(row: sweeps.Row) -> StudyRow:
    """Return the game, plans and certificates, wall time and machine."""
    names = ("scenario", "agents", "horizon", "speed", "lam", "player", "gap", "seconds", *FOUND)
    return {name: getattr(row, name) for name in names} | {
        "family": row.scenario.partition("(")[0],
        "regret": largest_regret(row),
        "machine": f"{platform.machine()} with {os.cpu_count()} processors",
    }


def games(rows: Sequence[StudyRow]) -> dict[str, list[tuple[StudyRow, StudyRow | None]]]:
    """Return, by family and in order of size, the rows of ``nash`` and, if any, of ``social``."""
    solved = grouped(
        [row for row in rows if "reason" not in row], lambda row: tuple(row[k] for k in AXES)
    )
    pairs = [{row["player"]: row for row in own} for own in solved.values()]
    both = [(pair["nash"], pair.get(OPTIMUM)) for pair in pairs if "nash" in pair]
    return grouped(both, lambda pair: pair[0]["family"])


def size_of(row: StudyRow) -> int:
    """Return the size of a game: its horizon in one family, its number of agents in the others."""
    return int(row["horizon"] if row["family"] == LONG else row["agents"])
