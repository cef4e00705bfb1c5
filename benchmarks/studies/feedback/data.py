r"""Selfish and social players with the same rules of play: plans, feedback and learning compared.

Every game is a scenario, a speed set and a lam, with the objective ``risk``.  In the environment
(arrival within a region, inputs projected) a selfish and a social player of each kind play it with
the same noise:

    planned    ``nash``, ``social``                     plans, tracked: each sees its own state
    replanned  ``receding-nash``, ``receding-social``   plans again, from the states of all agents
    feedback   ``feedback-nash``, ``feedback-social``   dynamic programming; two agents only
    learned    ``ppo-selfish``, ``ppo-social``          five runs of training each

    price in cost   expected cost of the selfish player over that of the social one
    price in risk   the same ratio of the probability that any agent crashes
    regret          what an agent gains by the best response that dynamic programming finds

There are as many groups of episodes as training runs; run r plays group r.  Intervals of ratios and
differences are Student's over the groups: for learners they cover training and noise, for the
others noise only.  Half a crash is added before the logarithm of a crash count is taken.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np

from baselines.evaluate_runs import over_runs
from benchmarks import sweeps
from benchmarks.studies.results import StudyRow
from benchmarks.studies.study import Choice
from benchmarks.sweeps import Cell
from ppg_env.scenarios.make import make_game
from ppg_env.support.statistics import Interval
from solvers.feedback.grid.extent import dynamic_programming_applies

KINDS = {
    "planned": ("nash", "social"),
    "replanned": ("receding-nash", "receding-social"),
    "feedback": ("feedback-nash", "feedback-social"),
    "learned": ("ppo-selfish", "ppo-social"),
}
"""Selfish and social player of each kind."""

PLAYERS = tuple(name for pair in KINDS.values() for name in pair)
SELFISH = tuple(selfish for selfish, _ in KINDS.values())
ORACLE = "feedback-social"

GROUPS = 5
"""Groups of episodes, as many as the pretrained players have runs."""

TIME_LIMIT = 120.0
"""Seconds for each plan; the status in the row shows whether it is proved."""

SAME = 0.05
"""Costs that differ by at most this share count as about the same, as in the paper."""

KEPT = (
    "speed", "scenario", "lam", "player", "status", "episodes", "arrival_mean",
    "expected_cost", "expected_cost_low", "expected_cost_high",
    "crash_probability", "crash_probability_low", "crash_probability_high",
    "group_costs", "group_crashes", "play_regret",
)  # fmt: skip
"""Columns of a sweep's row that the study uses."""

Key = tuple[str, str, float]
Games = dict[Key, dict[str, StudyRow]]
"""The rows of each speed set, scenario and lam, by player."""


def cells(choice: Choice) -> list[Cell]:
    """Return the cells, by speed set first; feedback players only where they can be computed."""
    games = product(choice.speeds, choice.scenarios, choice.lams)
    return [
        _cell(choice, name, scenario, {"speed": speed, "objective": "risk", "lam": lam})
        for speed, scenario, lam in games
        for name in _players(scenario)
    ]


def _players(scenario: str) -> Sequence[str]:
    if dynamic_programming_applies(make_game(scenario)):
        return PLAYERS
    return [name for name in PLAYERS if name not in KINDS["feedback"]]


def _cell(choice: Choice, name: str, scenario: str, fields: dict[str, object]) -> Cell:
    measured = name in SELFISH and dynamic_programming_applies(make_game(scenario))
    return Cell(
        scenario,
        name,
        fields,
        "env",
        choice.episodes,
        GROUPS,
        "grid" if measured and not name.startswith("receding") else None,
        time_limit=TIME_LIMIT,
        seed=choice.seed,
    )


def digest(row: sweeps.Row) -> StudyRow:
    """Return the columns of a stored row that the study uses."""
    return {name: getattr(row, name) for name in KEPT}


def by_game(rows: Iterable[StudyRow]) -> Games:
    """Return the rows with a result by game and player."""
    games: Games = {}
    for row in rows:
        if "reason" not in row:
            key = (row["speed"], row["scenario"], row["lam"])
            games.setdefault(key, {})[row["player"]] = row
    return games


def paired(row: StudyRow, other: StudyRow) -> Interval:
    """Return the difference of the costs of two players over the same noise."""
    return over_runs(np.array(row["group_costs"]) - np.array(other["group_costs"]))


def price(selfish: StudyRow, social: StudyRow, what: str) -> Interval:
    """Return the ratio of ``cost`` or ``risk`` of two players, with its interval."""
    logs = [_log(row, what) for row in (selfish, social)]
    ratio = over_runs(logs[0] - logs[1])
    return Interval(*np.exp([ratio.value, ratio.low, ratio.high]).tolist())


def _log(row: StudyRow, what: str) -> np.ndarray:
    if what == "cost":
        return np.log(row["group_costs"])
    count = row["episodes"] / len(row["group_crashes"]) + 0.5
    return np.log(np.array(row["group_crashes"]) + 0.5 / count)


def largest_regret(row: StudyRow) -> float | None:
    """Return the largest measured gain of an agent by a deviation, over its cost."""
    if "play_regret" not in row:
        return None
    return max(gain["value"] for gain in row["play_regret"]) / row["expected_cost"]
