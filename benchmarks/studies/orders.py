r"""How scores order plans for one game, against the probability that anybody crashes.

    tau         Kendall's tau-b of a score and the crash probability, over plans that differ
    told apart  pairs of plans whose 95 % limits of the crash probability are disjoint, limits below
                1e-4 counted as 1e-4
    right, tied, wrong   such pairs of which the score prefers the safer plan, neither, the other

A wrong pair is misordered beyond doubt.  A plan is a row with its ``scores``, of which lower ones
are meant to be safer, the smallest ``margins`` of each time, and ``plan``, a fingerprint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from benchmarks.studies.results import StudyRow, grouped, limits

ORDERS = ("right", "tied", "wrong")

TIE = 0.01
"""Scores closer than this share of the larger one count as tied: nobody would choose by them."""


@dataclass(frozen=True)
class PlanPair:
    """Two plans for one game, of which the first is the safer one beyond doubt."""

    safer: StudyRow
    riskier: StudyRow

    def order(self, score: int) -> str:
        """Whether a score, by its number, has the pair ``right``, ``tied`` or ``wrong``."""
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
    """The plans for one game that differ, and the pairs of them that are told apart."""

    name: str
    plans: Sequence[StudyRow]
    pairs: Sequence[PlanPair]

    def tau(self, score: int) -> float:
        """Kendall's tau-b of a score and the crash probability; nan if all crash alike."""
        from scipy.stats import kendalltau

        scores = [plan["scores"][score] for plan in self.plans]
        return float(kendalltau(scores, [plan["crash_probability"] for plan in self.plans])[0])

    def counts(self, score: int) -> dict[str, int]:
        """Pairs that are right, tied and wrong."""
        found = [pair.order(score) for pair in self.pairs]
        return {order: found.count(order) for order in ORDERS}


def games(rows: Sequence[StudyRow]) -> list[GamePlans]:
    """Games, each with its plans; of plans that are the same, the first stands for all.

    Left out are plans whose means overlap, such as most straight models: no planner may choose
    them.
    """
    found = []
    known = [row for row in rows if "reason" not in row and min(row["margins"]) >= 0]
    for name, mine in grouped(known, _game_name).items():
        plans = list({row["plan"]: row for row in reversed(mine)}.values())[::-1]
        pairs = [
            PlanPair(safer, riskier)
            for one, other in combinations(plans, 2)
            for safer, riskier in ((one, other), (other, one))
            if limits(safer)[1] < limits(riskier)[0]
        ]
        found.append(GamePlans(name, plans, pairs))
    return found


def _game_name(row: StudyRow) -> str:
    return f"{row['scenario']}, {row['speed']}, gain {row['gain']:g}"


def clearest(found: Sequence[GamePlans], score: int) -> tuple[GamePlans, PlanPair] | None:
    """The wrong pair whose crash probabilities are furthest apart, and its game."""
    wrong = [(game, pair) for game in found for pair in game.pairs if pair.order(score) == "wrong"]
    return max(wrong, key=lambda one: one[1].least, default=None)
