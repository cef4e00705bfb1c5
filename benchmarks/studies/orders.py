r"""The order of the plans for one game by a score, compared with that by crash probability.

    tau      Kendall's tau-b of a score and the probability of any crash, over distinct plans
    pairs    pairs of plans that differ significantly: their 95 % limits of the crash probability
             are disjoint, where limits below 1e-4 count as 1e-4
    right, tied, wrong   pairs of which the score prefers the plan that crashes less often, neither,
             or the other

A plan is a row with its ``scores`` (lower ones should crash less often), the smallest ``margins``
at each time, and ``plan``, a fingerprint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from benchmarks.studies.results import StudyRow, grouped, limits

ORDERS = ("right", "tied", "wrong")

TIE = 0.01
"""Scores count as tied if they differ by at most this share of the larger one."""


@dataclass(frozen=True)
class PlanPair:
    """Two plans for one game, of which the first is significantly safer."""

    safer: StudyRow
    riskier: StudyRow

    def order(self, score: int) -> str:
        """Return ``right``, ``tied`` or ``wrong``, by the score of this index."""
        good, bad = self.safer["scores"][score], self.riskier["scores"][score]
        if abs(good - bad) <= TIE * max(good, bad):
            return "tied"
        return "right" if good < bad else "wrong"

    @property
    def least(self) -> float:
        """Lower limit of the ratio of the two crash probabilities."""
        return limits(self.riskier)[0] / limits(self.safer)[1]


@dataclass(frozen=True)
class GamePlans:
    """The distinct plans for one game, and the pairs of them that differ significantly."""

    name: str
    plans: Sequence[StudyRow]
    pairs: Sequence[PlanPair]

    def tau(self, score: int) -> float:
        """Return Kendall's tau-b of a score and the crash probability; nan if all are equal."""
        from scipy.stats import kendalltau

        scores = [plan["scores"][score] for plan in self.plans]
        return float(kendalltau(scores, [plan["crash_probability"] for plan in self.plans])[0])

    def counts(self, score: int) -> dict[str, int]:
        """Return the number of pairs that are right, tied and wrong."""
        outcomes = [pair.order(score) for pair in self.pairs]
        return {order: outcomes.count(order) for order in ORDERS}


def games(rows: Sequence[StudyRow]) -> list[GamePlans]:
    """Return the games with their distinct plans; of equal plans, the first is kept.

    Plans whose means overlap, such as most straight models, are left out: no planner may choose
    them.
    """
    compared = []
    feasible = [row for row in rows if "reason" not in row and min(row["margins"]) >= 0]
    for name, own in grouped(feasible, _game_name).items():
        plans = list({row["plan"]: row for row in reversed(own)}.values())[::-1]
        pairs = [
            PlanPair(safer, riskier)
            for first, second in combinations(plans, 2)
            for safer, riskier in ((first, second), (second, first))
            if limits(safer)[1] < limits(riskier)[0]
        ]
        compared.append(GamePlans(name, plans, pairs))
    return compared


def _game_name(row: StudyRow) -> str:
    return f"{row['scenario']}, {row['speed']}, gain {row['gain']:g}"


def clearest(compared: Sequence[GamePlans], score: int) -> tuple[GamePlans, PlanPair] | None:
    """Return the wrong pair with the largest certain risk ratio, and its game; or None."""
    wrong = [
        (game, pair) for game in compared for pair in game.pairs if pair.order(score) == "wrong"
    ]
    return max(wrong, key=lambda example: example[1].least, default=None)
