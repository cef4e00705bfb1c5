"""The liability lab: liability rules and the social optimum.

In every game, best-response dynamics find an equilibrium under every rule of
:mod:`solvers.liability`, with the agents in the game's order and in reverse order; for right of way
that is the order of priority.  Equilibria are compared with the cheapest plans known: the social
optimum, or the plans of ``social`` where it is not proved.  (With four or five agents the exact
search takes too long here, and the cheapest equilibrium is used instead.)

    cost gap     sum of shifted costs over that of the cheapest plans, less one
    risk ratio   Pr(any crash) over theirs, as in :mod:`benchmarks.studies.prices`;
                 significant if the 95 % limits are disjoint

Agents are alike, all with the same lam, or (up to four) unlike: lam is spread evenly from
lam - 0.15 to lam + 0.15.  A rule *restores* the optimum of a game if its cost gap is at most 0.1 %
in both orders, and *can* restore it if the gap is that small in one of them.
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
from benchmarks.studies.study import StudyChoice

SHARES = ("selfish", "partial:0.25", "partial:0.5", "partial:0.75", "pigou")
"""Rules by the share of the harm to the other agent that is paid: 0, 1/4, 1/2, 3/4, 1."""

RIGHT_OF_WAY = "right-of-way"
RULES = (*SHARES, RIGHT_OF_WAY)
SOCIETIES = {"alike": 0.0, "unlike": 0.15}
"""Half the spread of lam, by kind of society."""

ORDERS = 2
"""Number of orders of the agents: the game's and its reverse."""

RESTORED = 1e-3
"""Largest cost gap that counts as zero; far above the tolerance of the solvers."""

EXACT, SEARCHED = 3, 6
"""Largest number of agents with a proved optimum, and smallest with a heuristic search."""

NODES = 3000
"""Node limit of ``social``: results do not depend on the machine."""


def cells(choice: StudyChoice) -> list[sweeps.Cell]:
    """Return the cells: every rule in both orders, and the optimum where it can be computed."""
    chosen = []
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
            chosen.append(replace(equilibrium, order=order, charge=charge))
        if size <= EXACT or size >= SEARCHED:
            chosen.append(optimum)
    return chosen


def digest(row: sweeps.Row) -> StudyRow:
    """Return the game, the rule, and costs and risks of its plans."""
    names = ("scenario", "speed", "agents", "lam", "lams", "player", "order", "gap", *FOUND)
    return {name: getattr(row, name) for name in names} | {
        "rule": RIGHT_OF_WAY if (row.charge or "").startswith(RIGHT_OF_WAY) else row.charge,
        "regret": largest_regret(row),
    }


@dataclass(frozen=True)
class GameUnderRules:
    """The rows of one game, under all rules."""

    rows: Sequence[StudyRow]

    @property
    def scenario(self) -> str:
        """Name of the scenario."""
        return str(self.rows[0]["scenario"])

    @property
    def agents(self) -> int:
        """Number of agents."""
        return int(self.rows[0]["agents"])

    @property
    def best(self) -> StudyRow:
        """The optimum, unless an equilibrium is cheaper by more than the solvers' tolerance."""
        ordered = sorted(self.rows, key=lambda row: row["player"] != OPTIMUM)
        return min(ordered, key=lambda row: round(row["social_cost"], 5))

    @property
    def proved(self) -> bool:
        """Whether the best row is a proved optimum."""
        return self.best["status"] == "optimal"

    def prices(self, rule: str) -> list[Price]:
        """Return costs and risks of the equilibria of a rule, relative to the cheapest plans."""
        return [
            Price(row, self.best)
            for row in self.rows
            if row.get("rule") == rule and row["status"] == "equilibrium"
        ]

    def gaps(self, rule: str) -> tuple[float, float]:
        """Return the smaller and the larger cost gap; infinite without convergence."""
        gaps = [max(price.cost - 1, 0.0) for price in self.prices(rule)]
        return min(gaps, default=inf), max(gaps) if len(gaps) == ORDERS else inf

    def restored(self, rule: str) -> bool:
        """Return whether both orders reach the least cost."""
        return self.gaps(rule)[1] <= RESTORED

    def can(self, rule: str) -> bool:
        """Return whether one of the orders reaches the least cost."""
        return self.gaps(rule)[0] <= RESTORED


def games(rows: Sequence[StudyRow]) -> dict[tuple[str, str, float], list[GameUnderRules]]:
    """Return the games by speed set, society and mean lam."""
    solved = [row for row in rows if "reason" not in row]
    each = grouped(solved, lambda row: (row["scenario"], row["speed"], tuple(row["lams"])))
    return grouped([GameUnderRules(own) for own in each.values()], _society)


def _society(game: GameUnderRules) -> tuple[str, str, float]:
    row = game.rows[0]
    kind = "alike" if row.get("lam") is not None else "unlike"
    return row["speed"], kind, round(float(np.mean(row["lams"])), 6)


def worst(game: GameUnderRules, rule: str) -> Price | None:
    """Return the riskier of the two orders; None without an equilibrium."""
    prices = game.prices(rule)
    return max(prices, key=lambda price: price.selfish["crash_probability"], default=None)
