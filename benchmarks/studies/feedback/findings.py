"""What the rows of the study ``feedback`` say, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.studies.feedback.data import (
    KINDS,
    ORACLE,
    SAME,
    SELFISH,
    Games,
    Key,
    by_game,
    largest_regret,
    paired,
    price,
)
from benchmarks.studies.prices import missing
from benchmarks.studies.results import StudyRow

CLOSE = 0.015
"""A learner within this share of the oracle's cost has reached it."""


def findings(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield a sentence per finding; those without rows are left out."""
    games = by_game(rows)
    for kind, pair in KINDS.items():
        played = {key: own for key, own in games.items() if set(pair) <= set(own)}
        if played:
            yield _paper(kind, pair, played)
    with_oracle = {key: own for key, own in games.items() if ORACLE in own}
    if with_oracle:
        yield _cheapest(with_oracle)
        for name in ("social", "ppo-social"):
            yield _distance(name, with_oracle)
    for name in SELFISH:
        regrets = {
            key: share
            for key, own in games.items()
            if name in own and (share := largest_regret(own[name])) is not None
        }
        if regrets:
            yield _regret(name, regrets)
    yield from missing(rows)


def _paper(kind: str, pair: tuple[str, str], games: Games) -> str:
    """Say whether selfish players of a kind cost about the same and crash more often."""
    ratios = {
        what: [price(own[pair[0]], own[pair[1]], what) for own in games.values()]
        for what in ("cost", "risk")
    }
    same = [abs(ratio.value - 1) <= SAME for ratio in ratios["cost"]]
    worse, safer = [r.low > 1 for r in ratios["risk"]], [r.high < 1 for r in ratios["risk"]]
    both = [key for key, *marks in zip(games, same, worse, strict=True) if all(marks)]
    values = [ratio.value for ratio in ratios["cost"]]
    risks = [ratio.value for ratio in ratios["risk"]]
    return (
        f"{kind.capitalize()} ({pair[0]} compared with {pair[1]}): costs differ by at most "
        f"{SAME:.0%} in {sum(same)} of {len(games)} games (ratio {min(values):.3f} to "
        f"{max(values):.3f}); crashes are significantly more likely in {sum(worse)}, less likely "
        f"in {sum(safer)} (median ratio {np.median(risks):.2g}, largest {max(risks):.3g}); about "
        f"the same cost and more crashes, as the paper reports, in {_named(both)}."
    )


def _cheapest(games: Games) -> str:
    """Say in which games another player is significantly cheaper than the oracle."""
    cheaper = [
        f"{name} at {_place(key)}"
        for key, own in games.items()
        for name, row in own.items()
        if name != ORACLE and paired(row, own[ORACLE]).high < 0
    ]
    count = sum(len(own) - 1 for own in games.values())
    listed = f": {', '.join(cheaper)}" if cheaper else ""
    return (
        f"Over the same noise, {len(cheaper)} of {count} other players in {len(games)} games are "
        f"significantly cheaper than {ORACLE}{listed}."
    )


def _distance(name: str, games: Games) -> str:
    """Say how much costlier a social player is than the oracle."""
    shares = {
        key: own[name]["expected_cost"] / own[ORACLE]["expected_cost"] - 1
        for key, own in games.items()
        if name in own
    }
    if not shares:
        return f"{name} did not play."
    far = [key for key, share in shares.items() if share > CLOSE]
    return (
        f"{name} costs {np.median(list(shares.values())):.1%} more than {ORACLE} in the median "
        f"game and {max(shares.values()):.1%} at most; more than {CLOSE:.1%} in {_named(far)} of "
        f"{len(shares)}."
    )


def _regret(name: str, regrets: dict[Key, float]) -> str:
    """Say how much an agent gains by leaving a selfish player."""
    far = [key for key, share in regrets.items() if share > CLOSE]
    worst = max(regrets, key=lambda key: regrets[key])
    return (
        f"{name}: the best response that dynamic programming finds gains "
        f"{np.median(list(regrets.values())):.1%} of the cost in the median game and "
        f"{regrets[worst]:.1%} at most ({_place(worst)}); more than {CLOSE:.1%} in {_named(far)} "
        f"of {len(regrets)}."
    )


def _place(key: Key) -> str:
    speed, scenario, lam = key
    return f"{scenario} {speed} {lam:g}"


def _named(keys: Sequence[Key]) -> str:
    """Return the number of games, with their names if they are few."""
    listed = f" ({', '.join(map(_place, keys))})" if 0 < len(keys) <= 12 else ""
    return f"{len(keys)} game{'' if len(keys) == 1 else 's'}{listed}"
