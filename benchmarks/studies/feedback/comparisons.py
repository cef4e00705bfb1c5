"""Sentences that compare single players: costs, distances from the optimum, regrets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.studies.feedback.data import ORACLE, SELFISH
from benchmarks.studies.feedback.measures import Games, Key, difference, played, ratio, regret

CLOSE = 0.015
"""A player within this share of a cost counts as having reached it."""


def cheapest(games: Games) -> str:
    """Say which players are significantly cheaper than the feedback optimum."""
    cheaper = [
        f"{name} at {place(key)}"
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


def distance(name: str, games: Games) -> str:
    """Say how much costlier a social player is than the feedback optimum."""
    shares = {key: ratio(own[name], own[ORACLE], "costs").value - 1 for key, own in games.items()}
    far = [key for key, share in shares.items() if share > CLOSE]
    worst = max(shares, key=lambda key: shares[key])
    return (
        f"{name} costs {np.median(list(shares.values())):.1%} more than {ORACLE} in the median "
        f"game and {shares[worst]:.1%} at most ({place(worst)}); more than {CLOSE:.1%} in "
        f"{len(far)} of {len(games)} games."
    )


def compared(rivals: tuple[str, str], games: Games) -> str:
    """Say in how many games the first of two players is cheaper, and in which it is costlier."""
    name, rival = rivals
    paired = {key: difference(own[name], own[rival]) for key, own in games.items()}
    cheaper = sum(gap.high < 0 for gap in paired.values())
    costlier = [key for key, gap in paired.items() if gap.low > 0]
    return (
        f"{name} compared with {rival}, same noise: cheaper in {cheaper} of {len(games)} games, no "
        f"significant difference in {len(games) - cheaper - len(costlier)}, costlier in "
        f"{named(costlier)}."
    )


def regrets(games: Games) -> Iterator[str]:
    """Say how much an agent gains by leaving each selfish player."""
    for name in SELFISH:
        gains = {key: regret(own[name]) for key, own in played(games, [name]).items()}
        shares = {key: gain.value for key, gain in gains.items() if gain is not None}
        if shares:
            worst = max(shares, key=lambda key: shares[key])
            far = [key for key, share in shares.items() if share > CLOSE]
            yield (
                f"{name} {np.median(list(shares.values())):.1%} of the cost in the median of "
                f"{len(shares)} games, {shares[worst]:.1%} at most ({place(worst)}), more than "
                f"{CLOSE:.1%} in {named(far)}"
            )


def place(key: Key) -> str:
    """Return a game in words."""
    speed, scenario, lam = key
    return f"{scenario} {speed} {lam:g}"


def named(keys: Sequence[Key]) -> str:
    """Return the number of games, with their names if they are few."""
    listed = f" ({', '.join(map(place, keys))})" if 0 < len(keys) <= 6 else ""
    return f"{len(keys)} game{'' if len(keys) == 1 else 's'}{listed}"
