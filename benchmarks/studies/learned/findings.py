"""What the rows of the study ``learned`` say, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.studies.learned.data import (
    KINDS,
    ORACLE,
    SELFISH,
    Games,
    Key,
    by_game,
    difference,
    played,
    ratio,
    regret,
)
from benchmarks.studies.prices import SAME, missing
from benchmarks.studies.results import StudyRow

CLOSE = 0.015
"""A player within this share of a cost counts as having reached it."""

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
        yield _cheapest(with_oracle)
    for name in ("social", "ppo-social"):
        if own := played(with_oracle, [name]):
            yield _distance(name, own)
    for rivals in RIVALS:
        if own := played(games, rivals):
            yield _compared(rivals, own)
    if regrets := list(_regrets(games)):
        yield "Regret, by the best response that dynamic programming finds: " + (
            "; ".join(regrets) + "."
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
        f"in {sum(safer)} (median ratio {np.median(risks):.2g}, largest {max(risks):.3g}); about "
        f"the same cost and more crashes, as the paper reports, in {_named(both)}."
    )


def _cheapest(games: Games) -> str:
    """Say which players are significantly cheaper than the feedback optimum."""
    cheaper = [
        f"{name} at {_place(key)}"
        for key, own in games.items()
        for name, row in own.items()
        if name != ORACLE and difference(row, own[ORACLE]).high < 0
    ]
    count = sum(len(own) - 1 for own in games.values())
    listed = f" ({', '.join(cheaper)})" if cheaper else ""
    return (
        f"{len(cheaper) or 'None'} of the {count} other results in {len(games)} games{listed} "
        f"{'is' if len(cheaper) < 2 else 'are'} significantly cheaper than {ORACLE}."
    )


def _distance(name: str, games: Games) -> str:
    """Say how much costlier a social player is than the feedback optimum."""
    shares = {key: ratio(own[name], own[ORACLE], "costs").value - 1 for key, own in games.items()}
    far = [key for key, share in shares.items() if share > CLOSE]
    worst = max(shares, key=lambda key: shares[key])
    return (
        f"{name} costs {np.median(list(shares.values())):.1%} more than {ORACLE} in the median "
        f"game and {shares[worst]:.1%} at most ({_place(worst)}); more than {CLOSE:.1%} in "
        f"{_named(far)} of {len(games)}."
    )


def _compared(rivals: tuple[str, str], games: Games) -> str:
    """Say in how many games the first of two players is cheaper, and in which it is costlier."""
    name, rival = rivals
    paired = {key: difference(own[name], own[rival]) for key, own in games.items()}
    cheaper = sum(gap.high < 0 for gap in paired.values())
    costlier = [key for key, gap in paired.items() if gap.low > 0]
    return (
        f"{name} compared with {rival}, same noise: cheaper in {cheaper} of {len(games)} games, no "
        f"significant difference in {len(games) - cheaper - len(costlier)}, costlier in "
        f"{_named(costlier)}."
    )


def _regrets(games: Games) -> Iterator[str]:
    """Say how much an agent gains by leaving each selfish player."""
    for name in SELFISH:
        gains = {key: regret(own[name]) for key, own in played(games, [name]).items()}
        shares = {key: gain.value for key, gain in gains.items() if gain is not None}
        if shares:
            worst = max(shares, key=lambda key: shares[key])
            far = [key for key, share in shares.items() if share > CLOSE]
            yield (
                f"{name} {np.median(list(shares.values())):.1%} of the cost in the median of "
                f"{len(shares)} games, {shares[worst]:.1%} at most ({_place(worst)}), more than "
                f"{CLOSE:.1%} in {_named(far)}"
            )


def _place(key: Key) -> str:
    speed, scenario, lam = key
    return f"{scenario} {speed} {lam:g}"


def _named(keys: Sequence[Key]) -> str:
    """Return the number of games, with their names if they are few."""
    listed = f" ({', '.join(map(_place, keys))})" if 0 < len(keys) <= 8 else ""
    return f"{len(keys)} game{'' if len(keys) == 1 else 's'}{listed}"
