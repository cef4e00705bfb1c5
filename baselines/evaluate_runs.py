"""Evaluate players over episodes and over training runs.

Every run plays its own group of episodes, so the means of the runs are independent draws of "train
with a fresh seed, then play": their Student interval covers both sources of randomness.  Groups
have the same noise for all players, so that players can be compared in pairs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ppg_env.env import episodes as arena
from ppg_env.env.episodes import Episodes, Summary
from ppg_env.env.players import Player
from ppg_env.env.randomize import Randomize
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.risk.splitting import split_risk
from ppg_env.support.statistics import Interval, RareEstimate, RareRisk, averaged

CONFIDENCE = 0.95

OF_A_LEVEL = 40_000
"""Episodes of each level when splitting: 2,000 in each of 20 repetitions."""


@dataclass(frozen=True)
class RunStatistics:
    """Statistics of R runs, each in its group of episodes.

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
        """(R,) share of each run's episodes in which any agent crashed."""
        return np.array([group.crashed.any(axis=1).mean() for group in self.groups])

    @property
    def successes(self) -> np.ndarray:
        """(R,) share of each run's agents that arrived."""
        return np.array([group.arrived.mean() for group in self.groups])

    def over_runs(self) -> dict[str, Interval]:
        """Return the means of cost, crashes and successes with their intervals over runs."""
        return {
            "expected_cost": over_runs(self.costs, 0.0),
            "crash_probability": over_runs(self.crashes, 0.0, 1.0),
            "success": over_runs(self.successes, 0.0, 1.0),
        }


def evaluate_runs(
    game: Game,
    runs: Sequence[Sequence[Player]],
    episodes: int,
    seed: int = 0,
    *,
    groups: int | None = None,
    rules: Rules | None = None,
    randomize: Randomize | None = None,
    progress: Callable[[int], None] | None = None,
) -> RunStatistics:
    """Simulate ``episodes`` in total under ``rules``, in ``groups`` (by default one per run).

    Episodes draw what ``randomize`` says.

    A single run plays all groups; several runs need one group each.
    """
    count = len(runs) if groups is None else groups
    require(len(runs) in (1, count), "runs", f"are {len(runs)}", f"give one or {count}")
    each = max(-(-episodes // count), 1)
    return RunStatistics(
        tuple(
            arena.evaluate(
                game,
                runs[r % len(runs)],
                each,
                seed,
                group=r,
                rules=rules,
                randomize=randomize,
                progress=progress,
            )
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
    rules: Rules | None = None,
    progress: Callable[[int], None] | None = None,
) -> RareRisk:
    """Estimate the crash probabilities under ``rules`` by splitting, averaged over the runs.

    ``episodes`` of each level are divided among the runs and their ``repetitions``.
    """
    states = max(episodes // (len(runs) * repetitions), 1)
    risks = [
        split_risk(
            game,
            players,
            states,
            seed + r,
            repetitions=repetitions,
            rules=rules,
            progress=progress,
        )
        for r, players in enumerate(runs)
    ]

    def mean(parts: Iterable[tuple[RareEstimate, ...]]) -> list[RareEstimate]:
        return [averaged(part, CONFIDENCE) for part in parts]

    return RareRisk(
        mean(zip(*(risk.agents for risk in risks), strict=True)),
        mean(zip(*(risk.encounters for risk in risks), strict=True)),
        averaged([risk.any for risk in risks], CONFIDENCE),
        sum(risk.samples for risk in risks),
    )


def over_runs(values: np.ndarray, low: float = -np.inf, high: float = np.inf) -> Interval:
    """Return the mean of independent runs with its Student interval, clipped to [low, high].

    The interval of a single run is nan.
    """
    from scipy.stats import t

    value, count = float(np.mean(values)), len(values)
    if count == 1:
        return Interval(value, float("nan"), float("nan"))
    half = float(t.ppf(0.5 + CONFIDENCE / 2, count - 1) * np.std(values, ddof=1) / np.sqrt(count))
    return Interval(value, max(value - half, low), min(value + half, high))
