"""The equilibrium atlas: which equilibria a game has, and how much of the starts each draws in.

Selfish best-response dynamics run from both first profiles (straight model; one after the other),
in every order of up to three agents and six orders of more, and in orders that are drawn anew for
every round.  Equilibria are of
one *kind* if the same agents pass each other on the same sides
(:mod:`solvers.equilibrium.enumeration`); those
of one kind may still differ in their costs.  The share of the runs that end in a kind is its basin.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from math import factorial
from typing import TYPE_CHECKING

import numpy as np

from benchmarks import sweeps
from benchmarks.studies.prices import FOUND, missing
from benchmarks.studies.results import Row, chance, grouped, limits
from benchmarks.studies.study import PAPER, Choice, Study, Table
from solvers.equilibrium.start_profile import STARTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
            sweeps.Cell(scenario, "nash", game, start, order, episodes=choice.episodes, seed=seed)
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


def digest(row: sweeps.Row) -> Row:
    """The game, how the run began, and the equilibrium with its name."""
    from ppg_env.formats.game_file import game_from_tables
    from ppg_env.game.plan import make_profile
    from solvers.equilibrium.enumeration import passing

    game = game_from_tables(row.game, row.scenario)
    names = ("scenario", "speed", "agents", "lam", "start", "order", "seed", "arrival", *FOUND)
    return {name: getattr(row, name) for name in names} | {
        "kind": passing(game, make_profile(game, row.controls or [])),
        "regret": row.regret and max(one or 0.0 for one in row.regret),
    }


@dataclass(frozen=True)
class Kind:
    """The runs that ended in equilibria of one kind, cheapest first."""

    name: str
    rows: Sequence[Row]

    def share(self, runs: Sequence[Row], start: str | None = None) -> float:
        """Share of ``runs``, or of those with one start, that ended here."""
        of = [row for row in runs if start in (None, row["start"])]
        return sum(start in (None, row["start"]) for row in self.rows) / len(of) if of else 0.0

    @property
    def distinct(self) -> list[Row]:
        """One row for each equilibrium: costs that differ, cheapest first."""
        kept = [self.rows[0]]
        for row in self.rows:
            if row["social_cost"] > kept[-1]["social_cost"] * (1 + SAME):
                kept.append(row)
        return kept


@dataclass(frozen=True)
class Game:
    """One game: all its runs, and the kinds of equilibrium that they ended in."""

    name: str
    runs: Sequence[Row]

    @property
    def ended(self) -> list[Row]:
        """Runs that ended at a certified equilibrium, cheapest first."""
        ended = [row for row in self.runs if row["status"] == "equilibrium"]
        return sorted(ended, key=lambda row: row["social_cost"])

    @property
    def kinds(self) -> list[Kind]:
        """By cost of their cheapest."""
        return [Kind(name, rows) for name, rows in grouped(self.ended, lambda r: r["kind"]).items()]

    @property
    def equilibria(self) -> list[Row]:
        """One row for each of all kinds, cheapest first."""
        found = [row for kind in self.kinds for row in kind.distinct]
        return sorted(found, key=lambda row: row["social_cost"])


def games(rows: Sequence[Row]) -> list[Game]:
    """The games of the atlas, in the order of the rows."""
    known = [row for row in rows if "reason" not in row]
    return [Game(name, mine) for name, mine in grouped(known, _name).items()]


def _name(row: Row) -> str:
    return f"{row['scenario']}, {row['speed']}, lam {row['lam']:g}"


HEADS = (
    "who passes whom", "equilibria", "share\nof runs", *(f"from\n{start}" for start in STARTS),
    "social cost", "crash\nprobability", "regret\nat most",
)  # fmt: skip


def tables(rows: Sequence[Row]) -> Iterator[Table]:
    """The kinds of every game."""
    for game in games(rows):
        yield Table(
            f"{game.name}: {len(game.runs)} runs",
            HEADS,
            [_line(game, kind) for kind in game.kinds],
            "Equilibria: those of a kind whose costs differ; ranges are over them.",
        )


def _line(game: Game, kind: Kind) -> tuple[str, ...]:
    distinct = kind.distinct
    risks = sorted(distinct, key=lambda row: row["crash_probability"])
    return (
        kind.name,
        str(len(distinct)),
        f"{kind.share(game.runs):.0%}",
        *(f"{kind.share(game.runs, start):.0%}" for start in STARTS),
        _range(f"{row['social_cost']:.3f}" for row in (distinct[0], distinct[-1])),
        _range(chance(row) for row in (risks[0], risks[-1])),
        f"{max(row['regret'] for row in kind.rows):.0e}",
    )


def _range(ends: Iterator[str]) -> str:
    return " to ".join(dict.fromkeys(ends))


def words(rows: Sequence[Row]) -> Iterator[str]:
    """What the rows say, in sentences that the data write."""
    found = games(rows)
    for game in found:
        known, kinds = game.equilibria, game.kinds
        if not known:
            yield f"{game.name}: no run ended at an equilibrium."
            continue
        often = max(kinds, key=lambda kind: kind.share(game.runs))
        dearest, cheapest = known[-1]["social_cost"], known[0]["social_cost"]
        best = sum(row["social_cost"] <= cheapest * (1 + SAME) for row in game.ended)
        yield (
            f"{game.name}: {len(known)} distinct in cost or kind, of {len(kinds)} kinds; the "
            f"dearest is {dearest / cheapest - 1:.2%} above the cheapest; {_risks(known)}. The "
            f"commonest kind is {often.name}, from {often.share(game.runs):.0%} of the runs; "
            f"{best / len(game.runs):.0%} end at the least cost."
        )
    lost = sum(row["status"] != "equilibrium" for game in found for row in game.runs)
    yield f"Runs that did not end at a certified equilibrium: {lost} of {len(rows)}."
    yield from missing(rows)


def _risks(known: Sequence[Row]) -> str:
    safest = min(known, key=lambda row: row["crash_probability_high"])
    riskiest = max(known, key=lambda row: row["crash_probability_low"])
    least = limits(riskiest)[0] / limits(safest)[1]
    if len(known) == 1:
        return f"its crash probability is {chance(riskiest)}"
    if least <= 1:
        return f"their crash probabilities are not told apart ({chance(riskiest)})"
    return (
        f"crash probabilities from {chance(safest)} to {chance(riskiest)}, "
        f"at least {least:.2g} times as likely"
    )


def draw(rows: Sequence[Row]) -> Mapping[str, Figure]:
    """A panel for each game."""
    from benchmarks.studies.atlas_figure import draw_atlas

    return {"": draw_atlas(games(rows))}


STUDY = Study(
    "atlas",
    "Which equilibria does a game have, and in which of them do best responses end?",
    Choice((*PAPER, "circle(4)"), ("l1",), (0.8,), episodes=20_000),
    cells,
    tables,
    words,
    draw,
    digest=digest,
)
