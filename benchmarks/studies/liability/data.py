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

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf

import numpy as np

from benchmarks import sweeps
from benchmarks.studies.prices import FOUND, OPTIMUM, Price
from benchmarks.studies.results import StudyRow, grouped, largest_regret
from benchmarks.studies.study import Choice

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


def digest(row: sweeps.Row) -> StudyRow:
    """The game, the rule, and what its plans cost and risk."""
    names = ("scenario", "speed", "agents", "lam", "lams", "player", "order", "gap", *FOUND)
    return {name: getattr(row, name) for name in names} | {
        "rule": RIGHT_OF_WAY if (row.charge or "").startswith(RIGHT_OF_WAY) else row.charge,
        "regret": largest_regret(row),
    }


@dataclass(frozen=True)
class GameUnderRules:
    """One game: its rows, and the cheapest of them."""

    rows: Sequence[StudyRow]

    @property
    def scenario(self) -> str:
        """Its name."""
        return str(self.rows[0]["scenario"])

    @property
    def agents(self) -> int:
        """How many."""
        return int(self.rows[0]["agents"])

    @property
    def best(self) -> StudyRow:
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


def games(rows: Sequence[StudyRow]) -> dict[tuple[str, str, float], list[GameUnderRules]]:
    """Games by speed set, society and mean lam."""
    known = [row for row in rows if "reason" not in row]
    each = grouped(known, lambda row: (row["scenario"], row["speed"], tuple(row["lams"])))
    return grouped([GameUnderRules(mine) for mine in each.values()], _society)


def _society(game: GameUnderRules) -> tuple[str, str, float]:
    row = game.rows[0]
    kind = "alike" if row.get("lam") is not None else "unlike"
    return row["speed"], kind, round(float(np.mean(row["lams"])), 6)


def worst(game: GameUnderRules, rule: str) -> Price | None:
    """The riskier one of the two orders."""
    return max(game.prices(rule), key=lambda one: one.selfish["crash_probability"], default=None)
