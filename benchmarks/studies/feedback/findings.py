"""What the rows of the study ``feedback`` say, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.studies.feedback.comparisons import cheapest, compared, distance, named, regrets
from benchmarks.studies.feedback.data import KINDS, ORACLE
from benchmarks.studies.feedback.measures import Games, by_game, played, ratio
from benchmarks.studies.prices import SAME, missing
from benchmarks.studies.results import StudyRow

RIVALS = (
    ("feedback-nash", "social"),
    ("ppo-selfish", "nash"),
    ("ppo-selfish", "feedback-nash"),
    ("ppo-social", "social"),
)
"""Pairs of players whose costs are compared over the same noise."""


def findings(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield a sentence per finding; those without rows are left out."""
    games = by_game(rows)
    for kind, pair in KINDS.items():
        if own := played(games, pair):
            yield _paper(kind, pair, own)
    with_oracle = played(games, [ORACLE])
    if with_oracle:
        yield cheapest(with_oracle)
    for name in ("social", "ppo-social"):
        if own := played(with_oracle, [name]):
            yield distance(name, own)
    for rivals in RIVALS:
        if own := played(games, rivals):
            yield compared(rivals, own)
    if gains := list(regrets(games)):
        yield "Regret, by the best response that dynamic programming finds: " + (
            "; ".join(gains) + "."
        )
    yield from missing(rows)


def _paper(kind: str, pair: tuple[str, str], games: Games) -> str:
    """Say whether selfish players of a kind cost about the same and crash more often."""
    costs, crashes = (
        [ratio(own[pair[0]], own[pair[1]], what) for own in games.values()]
        for what in ("costs", "crashes")
    )
    same = [abs(price.value - 1) <= SAME for price in costs]
    riskier, safer = [price.low > 1 for price in crashes], [price.high < 1 for price in crashes]
    both = [key for key, *marks in zip(games, same, riskier, strict=True) if all(marks)]
    values, risks = ([price.value for price in some] for some in (costs, crashes))
    return (
        f"{kind.capitalize()} ({pair[0]} compared with {pair[1]}): costs differ by at most "
        f"{SAME:.0%} in {sum(same)} of {len(games)} games (ratio {min(values):.3f} to "
        f"{max(values):.3f}); crashes are significantly more likely in {sum(riskier)}, less likely "
        f"in {sum(safer)} (median ratio {np.median(risks):.3g}, largest {max(risks):.3g}); about "
        f"the same cost and more crashes, as the paper reports, in {named(both)}."
    )
