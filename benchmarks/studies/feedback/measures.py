"""Prices, differences and regrets, from the rows of the study ``feedback``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from baselines.evaluate_runs import over_runs
from benchmarks.studies.results import NEGLIGIBLE, StudyRow
from ppg_env.support.statistics import Interval

Key = tuple[str, str, float]
"""Speed set, scenario and lam of a game."""

Games = dict[Key, dict[str, StudyRow]]
"""The rows of each game, by player."""


def by_game(rows: Iterable[StudyRow]) -> Games:
    """Return the rows with a result by game and player."""
    games: Games = {}
    for row in rows:
        if "reason" not in row:
            key = (row["speed"], row["scenario"], row["lam"])
            games.setdefault(key, {})[row["player"]] = row
    return games


def difference(row: StudyRow, other: StudyRow) -> Interval:
    """Return the difference of the costs of two players over the same noise."""
    return over_runs(np.array(row["group_costs"]) - np.array(other["group_costs"]))


def ratio(row: StudyRow, other: StudyRow, what: str) -> Interval:
    """Return the ratio of ``costs`` or ``crashes`` of two players, with its interval."""
    least = NEGLIGIBLE if what == "crashes" else 0.0
    logs = (np.log(np.maximum(one[f"group_{what}"], least)) for one in (row, other))
    mean = over_runs(np.subtract(*logs))
    return Interval(*np.exp([mean.value, mean.low, mean.high]).tolist())


def regret(row: StudyRow) -> Interval | None:
    """Return the largest gain of an agent by a deviation, over the mean cost; None without one."""
    if "play_regret" not in row:
        return None
    largest = max(row["play_regret"], key=lambda gain: float(gain["value"]))
    return Interval(*(largest[name] / row["expected_cost"] for name in ("value", "low", "high")))


def played(games: Games, names: Sequence[str]) -> Games:
    """Return the games that all players ``names`` have played."""
    return {key: own for key, own in games.items() if set(names) <= set(own)}
