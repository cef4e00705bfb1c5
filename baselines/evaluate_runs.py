"""Players judged over episodes and over training runs.

Every run plays a group of episodes of its own, so the means of the runs are independent draws of
"train with a fresh seed, then play": their Student interval covers both kinds of chance.  Groups
have the same noise for all players, so that players can be compared pair by pair.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ppg_env.env import episodes as arena
from ppg_env.env.episodes import Episodes, Summary
from ppg_env.env.players import Player
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.risk.splitting import split_risk
from ppg_env.support.statistics import Interval, RareEstimate, RareRisk, averaged

CONFIDENCE = 0.95

OF_A_LEVEL = 40_000
"""Episodes of each level when splitting: 2,000 in each of 20 repetitions."""


@dataclass(frozen=True)
class RunStatistics:
    """What R runs did in their groups of episodes.

    Attributes
    ----------
    groups : the episodes of each run.
    """

    groups: tuple[Episodes, ...]

    @property
    def summary(self) -> Summary:
        """All episodes together; its intervals take the runs as given."""
        return Episodes.joined(self.groups).summary(CONFIDENCE)

    @property
    def costs(self) -> np.ndarray:
        """(R,) mean cost of each run, over agents and episodes."""
        return np.array([group.cost.mean() for group in self.groups])

    @property
    def crashes(self) -> np.ndarray:
        """(R,) share of each run's episodes in which anybody crashed."""
        return np.array([group.crashed.any(axis=1).mean() for group in self.groups])

    @property
    def successes(self) -> np.ndarray:
        """(R,) share of each run's agents that arrived."""
        return np.array([group.arrived.mean() for group in self.groups])


def evaluate_runs(
    game: Game,
    runs: Sequence[Sequence[Player]],
    episodes: int,
    seed: int = 0,
    *,
    groups: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> RunStatistics:
    """Let the runs play ``episodes`` altogether, in ``groups`` (one per run unless given).

    A single run plays all groups; with more, there must be one group for each.
    """
    count = len(runs) if groups is None else groups
    require(len(runs) in (1, count), "runs", f"are {len(runs)}", f"give one or {count}")
    each = max(-(-episodes // count), 1)
    return RunStatistics(
        tuple(
            arena.evaluate(game, runs[r % len(runs)], each, seed, group=r, progress=progress)
            for r in range(count)
        )
    )


def evaluate_rare_runs(
    game: Game,
    runs: Sequence[Sequence[Player]],
    episodes: int = OF_A_LEVEL,
    seed: int = 0,
    *,
    repetitions: int = 20,
    progress: Callable[[int], None] | None = None,
) -> RareRisk:
    """Crash probabilities of the runs, averaged, by splitting.

    ``episodes`` are those of each level, shared out among the runs and their ``repetitions``.
    """
    states = max(episodes // (len(runs) * repetitions), 1)
    found = [
        split_risk(game, players, states, seed + r, repetitions=repetitions, progress=progress)
        for r, players in enumerate(runs)
    ]

    def mean(parts: Iterable[tuple[RareEstimate, ...]]) -> list[RareEstimate]:
        return [averaged(part, CONFIDENCE) for part in parts]

    return RareRisk(
        mean(zip(*(one.agents for one in found), strict=True)),
        mean(zip(*(one.encounters for one in found), strict=True)),
        averaged([one.any for one in found], CONFIDENCE),
        sum(one.samples for one in found),
    )


def over_runs(values: np.ndarray, low: float = -np.inf, high: float = np.inf) -> Interval:
    """Mean of independent runs with its Student interval, cut off at what is possible.

    A single run says nothing about others: its interval is nan.
    """
    from scipy.stats import t

    value, count = float(np.mean(values)), len(values)
    if count == 1:
        return Interval(value, float("nan"), float("nan"))
    half = float(t.ppf(0.5 + CONFIDENCE / 2, count - 1) * np.std(values, ddof=1) / np.sqrt(count))
    return Interval(value, max(value - half, low), min(value + half, high))
