"""The equilibrium atlas: the equilibria of a game, and the share of runs that end in each.

Selfish best-response dynamics start from both first profiles (straight model; sequential), in every
order of up to three agents, in six orders of more, and in orders drawn again for every round.
Equilibria are of one *kind* if the same agents pass each other on the same sides
(:mod:`solvers.equilibrium.enumeration`); equilibria of one kind may differ in cost.  The share of
the runs that end in a kind is its basin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product
from math import factorial

import numpy as np

from benchmarks import sweeps
from benchmarks.studies.prices import FOUND
from benchmarks.studies.results import StudyRow, grouped, largest_regret
from benchmarks.studies.study import StudyChoice
from solvers.equilibrium.start_profile import STARTS

RANDOM = 12
"""Number of runs with orders drawn again for every round, from each first profile."""

FIXED = 6
"""Largest number of fixed orders."""

SAME = 1e-3
"""Equilibria whose costs differ by at most this share count as one."""


def cells(choice: StudyChoice) -> list[sweeps.Cell]:
    """Return the cells: both first profiles with all orders, fixed and drawn."""
    chosen = []
    for scenario, speed, lam in product(choice.scenarios, choice.speeds, choice.lams):
        game = {"speed": speed, "objective": "risk", "gain": 0.0, "lam": lam}
        size = len(sweeps.Cell(scenario, "nash", game).game.agents)
        orders: list[tuple[str | tuple[int, ...], int]] = [
            *((order, choice.seed) for order in _orders(size)),
            *(("random", choice.seed + k) for k in range(RANDOM)),
        ]
        chosen += [
            sweeps.Cell(
                scenario,
                "nash",
                game,
                start=start,
                order=order,
                episodes=choice.episodes,
                seed=seed,
            )
            for start, (order, seed) in product(STARTS, orders)
        ]
    return chosen


def _orders(size: int) -> list[tuple[int, ...]]:
    """Return all orders of a few agents, or some of more, drawn with a seed of their own."""
    if factorial(size) <= FIXED:
        return list(permutations(range(size)))
    random, orders = np.random.default_rng(size), dict[tuple[int, ...], None]()
    while len(orders) < FIXED:
        orders[tuple(random.permutation(size).tolist())] = None
    return list(orders)


def digest(row: sweeps.Row) -> StudyRow:
    """Return the game, the start and order of the run, and the equilibrium with its kind."""
    from ppg_env.formats.game_file import game_from_tables
    from ppg_env.game.plan import make_profile
    from solvers.equilibrium.enumeration import passing

    game = game_from_tables(row.game, row.scenario)
    names = ("scenario", "speed", "agents", "lam", "start", "order", "seed", "arrival", *FOUND)
    return {name: getattr(row, name) for name in names} | {
        "kind": passing(game, make_profile(game, row.controls or [])),
        "regret": largest_regret(row),
    }


@dataclass(frozen=True)
class EquilibriumKind:
    """The runs that ended in equilibria of one kind, cheapest first."""

    name: str
    rows: Sequence[StudyRow]

    def share(self, runs: Sequence[StudyRow], start: str | None = None) -> float:
        """Return the share of ``runs``, or of those with one start, that ended in this kind."""
        of = [row for row in runs if start in (None, row["start"])]
        return sum(start in (None, row["start"]) for row in self.rows) / len(of) if of else 0.0

    @property
    def distinct(self) -> list[StudyRow]:
        """One row for each equilibrium, that is, for each distinct cost; cheapest first."""
        kept = [self.rows[0]]
        for row in self.rows:
            if row["social_cost"] > kept[-1]["social_cost"] * (1 + SAME):
                kept.append(row)
        return kept


@dataclass(frozen=True)
class GameEquilibria:
    """The runs of one game, and the kinds of equilibrium that they ended in."""

    name: str
    runs: Sequence[StudyRow]

    @property
    def ended(self) -> list[StudyRow]:
        """Runs that ended at a certified equilibrium, cheapest first."""
        ended = [row for row in self.runs if row["status"] == "equilibrium"]
        return sorted(ended, key=lambda row: row["social_cost"])

    @property
    def kinds(self) -> list[EquilibriumKind]:
        """The kinds of equilibrium, by the cost of the cheapest of each."""
        return [
            EquilibriumKind(name, rows)
            for name, rows in grouped(self.ended, lambda r: r["kind"]).items()
        ]

    @property
    def equilibria(self) -> list[StudyRow]:
        """One row for each equilibrium of all kinds, cheapest first."""
        distinct = [row for kind in self.kinds for row in kind.distinct]
        return sorted(distinct, key=lambda row: row["social_cost"])


def games(rows: Sequence[StudyRow]) -> list[GameEquilibria]:
    """Return the games of the atlas, in the order of the rows."""
    solved = [row for row in rows if "reason" not in row]
    return [GameEquilibria(name, own) for name, own in grouped(solved, _name).items()]


def _name(row: StudyRow) -> str:
    return f"{row['scenario']}, {row['speed']}, lam {row['lam']:g}"
