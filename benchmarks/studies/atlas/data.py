"""The equilibrium atlas: which equilibria a game has, and how much of the starts each draws in.

Selfish best-response dynamics run from both first profiles (straight model; one after the other),
in every order of up to three agents and six orders of more, and in orders that are drawn anew for
every round.  Equilibria are of
one *kind* if the same agents pass each other on the same sides
(:mod:`solvers.equilibrium.enumeration`); those
of one kind may still differ in their costs.  The share of the runs that end in a kind is its basin.
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
from benchmarks.studies.study import Choice
from solvers.equilibrium.start_profile import STARTS

RANDOM = 12
"""Runs with orders drawn anew for every round, from each first profile."""

FIXED = 6
"""Fixed orders, at most."""

SAME = 1e-3
"""Costs that differ by no more than this share are those of one equilibrium."""


def cells(choice: Choice) -> list[sweeps.Cell]:
    """Both first profiles with all orders, fixed and drawn."""
    found = []
    for scenario, speed, lam in product(choice.scenarios, choice.speeds, choice.lams):
        game = {"speed": speed, "objective": "risk", "gain": 0.0, "lam": lam}
        size = len(sweeps.Cell(scenario, "nash", game).game.agents)
        orders: list[tuple[str | tuple[int, ...], int]] = [
            *((order, choice.seed) for order in _orders(size)),
            *(("random", choice.seed + k) for k in range(RANDOM)),
        ]
        found += [
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
    return found


def _orders(size: int) -> list[tuple[int, ...]]:
    """All orders of a few agents, or some of more, drawn with a seed of their own."""
    if factorial(size) <= FIXED:
        return list(permutations(range(size)))
    random, found = np.random.default_rng(size), dict[tuple[int, ...], None]()
    while len(found) < FIXED:
        found[tuple(random.permutation(size).tolist())] = None
    return list(found)


def digest(row: sweeps.Row) -> StudyRow:
    """The game, how the run began, and the equilibrium with its name."""
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
        """Share of ``runs``, or of those with one start, that ended here."""
        of = [row for row in runs if start in (None, row["start"])]
        return sum(start in (None, row["start"]) for row in self.rows) / len(of) if of else 0.0

    @property
    def distinct(self) -> list[StudyRow]:
        """One row for each equilibrium: costs that differ, cheapest first."""
        kept = [self.rows[0]]
        for row in self.rows:
            if row["social_cost"] > kept[-1]["social_cost"] * (1 + SAME):
                kept.append(row)
        return kept


@dataclass(frozen=True)
class GameEquilibria:
    """One game: all its runs, and the kinds of equilibrium that they ended in."""

    name: str
    runs: Sequence[StudyRow]

    @property
    def ended(self) -> list[StudyRow]:
        """Runs that ended at a certified equilibrium, cheapest first."""
        ended = [row for row in self.runs if row["status"] == "equilibrium"]
        return sorted(ended, key=lambda row: row["social_cost"])

    @property
    def kinds(self) -> list[EquilibriumKind]:
        """By cost of their cheapest."""
        return [
            EquilibriumKind(name, rows)
            for name, rows in grouped(self.ended, lambda r: r["kind"]).items()
        ]

    @property
    def equilibria(self) -> list[StudyRow]:
        """One row for each of all kinds, cheapest first."""
        found = [row for kind in self.kinds for row in kind.distinct]
        return sorted(found, key=lambda row: row["social_cost"])


def games(rows: Sequence[StudyRow]) -> list[GameEquilibria]:
    """The games of the atlas, in the order of the rows."""
    known = [row for row in rows if "reason" not in row]
    return [GameEquilibria(name, mine) for name, mine in grouped(known, _name).items()]


def _name(row: StudyRow) -> str:
    return f"{row['scenario']}, {row['speed']}, lam {row['lam']:g}"
