"""The liability lab: which rule of who pays for an encounter restores the social optimum?

In every game best-response dynamics find an equilibrium under every rule of
:mod:`solvers.liability`, with the agents in the game's order and in reverse; for right of way that
is the order of priority.  They are compared with the cheapest plans known: the social optimum, or
what ``social`` found where that is not proved.  (With four or five agents the exact search for it
takes too long here, and the cheapest equilibrium stands in.)

    cost gap     sum of shifted costs over that of the cheapest plans, less one
    risk ratio   Pr(anybody crashes) over theirs, as in :mod:`benchmarks.studies.prices`;
                 beyond doubt if the 95 % limits are disjoint

Agents are alike, all with the same lam, or (up to four) unlike: spread evenly from lam - 0.15 to
lam + 0.15.
A rule *restores* the optimum of a game if its cost gap is at most 0.1 % in both orders, and *can*
restore it if it is so in one of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from benchmarks import sweeps
from benchmarks.studies.prices import FOUND, OPTIMUM, Price, missing
from benchmarks.studies.results import Row, grouped
from benchmarks.studies.study import PAPER, Choice, Study, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHARES = ("selfish", "partial:0.25", "partial:0.5", "partial:0.75", "pigou")
"""Rules by the share of the harm to the other: 0, 1/4, 1/2, 3/4, 1."""

RIGHT_OF_WAY = "right-of-way"
RULES = (*SHARES, RIGHT_OF_WAY)
SOCIETIES = {"alike": 0.0, "unlike": 0.15}
"""Half the spread of lam."""

ORDERS = 2
"""Orders of the agents, the game's and its reverse."""

RESTORED = 1e-3
"""Largest cost gap that counts as none: far above what solvers leave."""

EXACT, SEARCHED = 3, 6
"""Agents up to which the optimum is proved, and from which plans are searched for instead."""

NODES = 3000
"""Linear programs of ``social``, at most: the same result on every machine."""


def cells(choice: Choice) -> list[sweeps.Cell]:
    """Every rule in both orders, and the optimum where it can be had."""
    found = []
    games = product(choice.scenarios, choice.speeds, choice.lams, SOCIETIES.values())
    for scenario, speed, lam, spread in games:
        base = {"speed": speed, "objective": "risk", "gain": 0.0}
        size = len(sweeps.Cell(scenario, OPTIMUM, base).game.agents)
        if spread and size >= SEARCHED:
            continue
        lams = np.linspace(lam - spread, lam + spread, size).round(6).tolist() if spread else lam
        optimum = sweeps.Cell(
            scenario,
            OPTIMUM,
            {**base, "lam": lams},
            episodes=choice.episodes,
            seed=choice.seed,
            node_limit=NODES,
        )
        equilibrium = replace(optimum, player="nash", node_limit=None)
        orders = (tuple(range(size)), tuple(range(size))[::-1])
        for rule, order in product(RULES, orders):
            charge = rule if rule in SHARES else f"{rule}:{'-'.join(map(str, order))}"
            found.append(replace(equilibrium, order=order, charge=charge))
        if size <= EXACT or size >= SEARCHED:
            found.append(optimum)
    return found


def digest(row: sweeps.Row) -> Row:
    """The game, the rule, and what its plans cost and risk."""
    names = ("scenario", "speed", "agents", "lam", "lams", "player", "order", "gap", *FOUND)
    return {name: getattr(row, name) for name in names} | {
        "rule": RIGHT_OF_WAY if (row.charge or "").startswith(RIGHT_OF_WAY) else row.charge,
        "regret": row.regret and max(one or 0.0 for one in row.regret),
    }


@dataclass(frozen=True)
class Game:
    """One game: its rows, and the cheapest of them."""

    rows: Sequence[Row]

    @property
    def scenario(self) -> str:
        """Its name."""
        return str(self.rows[0]["scenario"])

    @property
    def agents(self) -> int:
        """How many."""
        return int(self.rows[0]["agents"])

    @property
    def best(self) -> Row:
        """The optimum, unless an equilibrium is cheaper by more than solvers leave."""
        known = sorted(self.rows, key=lambda row: row["player"] != OPTIMUM)
        return min(known, key=lambda row: round(row["social_cost"], 5))

    @property
    def proved(self) -> bool:
        """Whether nothing can be cheaper."""
        return self.best["status"] == "optimal"

    def prices(self, rule: str) -> list[Price]:
        """What the equilibria of a rule cost and risk, against the cheapest plans."""
        return [
            Price(row, self.best)
            for row in self.rows
            if row.get("rule") == rule and row["status"] == "equilibrium"
        ]

    def gaps(self, rule: str) -> tuple[float, float]:
        """The smaller and the larger cost gap; infinite where the dynamics did not settle."""
        found = [max(one.cost - 1, 0.0) for one in self.prices(rule)]
        return min(found, default=inf), max(found) if len(found) == ORDERS else inf

    def restored(self, rule: str) -> bool:
        """Whether both orders come to the least cost."""
        return self.gaps(rule)[1] <= RESTORED

    def can(self, rule: str) -> bool:
        """Whether one of the orders does."""
        return self.gaps(rule)[0] <= RESTORED


def games(rows: Sequence[Row]) -> dict[tuple[str, str, float], list[Game]]:
    """Games by speed set, society and mean lam."""
    known = [row for row in rows if "reason" not in row]
    each = grouped(known, lambda row: (row["scenario"], row["speed"], tuple(row["lams"])))
    return grouped([Game(mine) for mine in each.values()], _society)


def _society(game: Game) -> tuple[str, str, float]:
    row = game.rows[0]
    kind = "alike" if row.get("lam") is not None else "unlike"
    return row["speed"], kind, round(float(np.mean(row["lams"])), 6)


HEADS = ("scenario", "N", *(rule.replace(":", "\n") for rule in RULES))


def tables(rows: Sequence[Row]) -> Iterator[Table]:
    """Cost gaps and risk ratios of every game."""
    for (speed, kind, lam), found in games(rows).items():
        where = f"agents {kind}, {'mean ' * (kind == 'unlike')}lam {lam:g}, speed set {speed}"
        yield Table(
            f"Cost gap, {where}",
            HEADS,
            [(*_named(game), *(_gap(game, rule) for rule in RULES)) for game in found],
            "In per cent; of the two orders, if they differ. Star: the least cost is not proved.",
        )
        yield Table(
            f"Risk ratio, {where}",
            HEADS,
            [(*_named(game), *(_risk(game, rule) for rule in RULES)) for game in found],
            "The order that is riskier. In brackets: not beyond doubt.",
        )


def _named(game: Game) -> tuple[str, str]:
    return game.scenario + "*" * (not game.proved), str(game.agents)


def _gap(game: Game, rule: str) -> str:
    shown = [f"{100 * gap:.2f}" if gap < inf else "no end" for gap in game.gaps(rule)]
    return " to ".join(dict.fromkeys(shown))


def worst(game: Game, rule: str) -> Price | None:
    """The riskier one of the two orders."""
    return max(game.prices(rule), key=lambda one: one.selfish["crash_probability"], default=None)


def _risk(game: Game, rule: str) -> str:
    one = worst(game, rule)
    if one is None:
        return "-"
    return f"{one.risk:.3g}" if one.riskier or one.safer else f"({one.risk:.3g})"


def words(rows: Sequence[Row]) -> Iterator[str]:
    """What the rows say, in sentences that the data write."""
    found = [game for some in games(rows).values() for game in some]
    for size, mine in sorted(grouped(found, lambda game: game.agents).items()):
        counts = ", ".join(
            f"{rule} {sum(g.restored(rule) for g in mine)} ({sum(g.can(rule) for g in mine)})"
            for rule in RULES
        )
        yield (
            f"{size} agents: of {len(mine)} games each rule restores the optimum (can restore it) "
            f"in: {counts}."
        )
    for rule in RULES:
        settled = [game for game in found if game.gaps(rule)[1] < inf]
        if not settled:
            continue
        told = [one for game in settled if (one := worst(game, rule))]
        low, high = np.mean([game.gaps(rule) for game in settled], axis=0)
        dearest = max((game.gaps(rule)[1], game.scenario) for game in settled)
        yield (
            f"{rule}: cost gap {low:.2%} on average in the better order, {high:.2%} in the worse, "
            f"at most {dearest[0]:.2%} ({dearest[1]}); in its riskier order riskier than the "
            f"cheapest plans beyond doubt in {sum(one.riskier for one in told)} of {len(told)} "
            f"games, safer in {sum(one.safer for one in told)}."
        )
    yield from _shares(found)
    unsettled = sum(game.gaps(rule)[1] == inf for game in found for rule in RULES)
    yield f"Rules and games in which the dynamics did not end at an equilibrium: {unsettled}."
    yield from missing(rows)


def _shares(found: Sequence[Game]) -> Iterator[str]:
    """How large a share is enough where paying for all the harm is."""
    cured = [g for g in found if g.can("pigou") and not g.can("selfish")]
    if not cured:
        return
    least = [next(rule for rule in SHARES if game.can(rule)) for game in cured]
    counts = ", ".join(f"{rule} in {least.count(rule)}" for rule in SHARES if rule in least)
    yield (
        f"The optimum that selfish agents miss in both orders and pigou can restore: {len(cured)} "
        f"games; the smallest share that can restore it is {counts}."
    )


def draw(rows: Sequence[Row]) -> Mapping[str, Figure]:
    """Cost gaps above, risk ratios below; a column for each society."""
    from benchmarks.studies.liability.figure import draw_games

    by_speed = grouped(games(rows).items(), lambda item: item[0][0])
    return {
        speed if len(by_speed) > 1 else "": draw_games(some) for speed, some in by_speed.items()
    }


STUDY = Study(
    "liability",
    "Which rule of liability restores the social optimum, and among how many agents?",
    Choice(
        (*PAPER, "circle(4)", "circle(6)", "streams(6)"),
        ("l1",),
        (0.8,),
        episodes=100_000,
    ),
    cells,
    tables,
    words,
    draw,
    digest=digest,
)
