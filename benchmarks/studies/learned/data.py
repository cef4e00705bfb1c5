r"""Price in safety of learned selfish agents, compared with equilibrium planners.

Every cell is a scenario, a speed set and a lam.  Four players play it with the same noise in the
environment (arrival within a region, inputs projected): the tracked plans of ``nash`` and
``social``, planned for the risk objective, and the pretrained ``ppo-selfish`` and ``ppo-social``.

    price in cost   expected cost of the selfish player over that of the social one
    price in risk   the same ratio of the probability that any agent crashes

There are as many groups of episodes as training runs; run r plays group r.  Intervals are Student's
over the groups: for learners they cover training and noise, for planners noise only.  Half a crash
is added before the logarithm of a crash count is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from baselines.evaluate_runs import RunStatistics, evaluate_runs, over_runs
from baselines.pretrained import find_pretrained
from benchmarks.studies.results import StudyRow
from benchmarks.studies.study import StudyChoice
from ppg_env.env.players import Player, track
from ppg_env.game.game import Game
from ppg_env.scenarios.make import make_game
from ppg_env.support.statistics import Interval

PLAYERS = ("nash", "social", "ppo-selfish", "ppo-social")
KINDS = {"planned": ("nash", "social"), "learned": ("ppo-selfish", "ppo-social")}
"""Selfish and social player of each kind."""

RIVALS = {"ppo-selfish": "nash", "ppo-social": "social"}
"""The planner that each learner is compared with, with the same noise."""

TIME_LIMIT = 120.0
"""Seconds for each plan; the status in the row shows whether it is proved."""

SAME = 0.05
"""Costs that differ by at most this share count as about the same, as in the paper."""


@dataclass(frozen=True)
class LearnedCell:
    """One game of the study."""

    scenario: str
    speed: str
    lam: float

    def game(self) -> Game:
        """Return the game, with the objective of the planners."""
        return make_game(self.scenario, speed=self.speed, lam=self.lam, objective="risk")


def cells(choice: StudyChoice) -> list[LearnedCell]:
    """Return all cells, by speed set first."""
    return [
        LearnedCell(scenario, speed, lam)
        for speed, scenario, lam in product(choice.speeds, choice.scenarios, choice.lams)
    ]


def run_cell(cell: LearnedCell, episodes: int, seed: int) -> StudyRow:
    """Play one cell, and return its row.

    A row without ``players`` has the ``reason`` why a planner has no solution.
    """
    game = cell.game()
    row: StudyRow = vars(cell) | {"episodes": episodes, "seed": seed}
    learned = {name: find_pretrained(name, game) for name in KINDS["learned"]}
    groups = len(learned["ppo-selfish"].runs)
    sides: dict[str, list[Sequence[Player]]] = {
        name: [policy.players(game, run) for run in range(groups)]
        for name, policy in learned.items()
    }
    for name in KINDS["planned"]:
        solution = _plan(name, game)
        if solution.profile is None:
            return row | {"reason": f"{name}: {solution.advice}"}
        row[f"{name}_status"] = str(solution.status)
        sides[name] = [track(game, solution.profile)]
    played = {
        name: evaluate_runs(game, sides[name], episodes, seed, groups=groups) for name in PLAYERS
    }
    return row | {
        "players": {name: _statistics(played[name]) for name in PLAYERS},
        "paired": {
            name: vars(over_runs(played[name].costs - played[rival].costs))
            for name, rival in RIVALS.items()
        },
        "price": {kind: _price(played[a], played[b]) for kind, (a, b) in KINDS.items()},
    }


def _plan(name: str, game: Game) -> Any:
    from solvers import best_response_dynamics, social_optimum

    planner = best_response_dynamics if name == "nash" else social_optimum
    return planner(game, time_limit=TIME_LIMIT)


def _statistics(runs: RunStatistics) -> dict[str, Any]:
    return {
        "cost": vars(over_runs(runs.costs, 0.0)),
        "crash": vars(_crash(runs)),
        "success": vars(over_runs(runs.successes, 0.0, 1.0)),
    }


def _crash(runs: RunStatistics) -> Interval:
    """Return the interval over the groups; without crashes, the 97.5 % limit of all episodes."""
    interval, counted = over_runs(runs.crashes, 0.0, 1.0), runs.summary.crash_any
    return interval if counted.hits else Interval(0.0, 0.0, counted.high)


def _price(selfish: RunStatistics, social: RunStatistics) -> dict[str, Any]:
    count = len(selfish.groups[0].cost) + 0.5
    logs = [np.log(runs.crashes + 0.5 / count) for runs in (selfish, social)]
    return {
        "cost": vars(_ratio(np.log(selfish.costs), np.log(social.costs))),
        "risk": vars(_ratio(*logs)),
    }


def _ratio(above: np.ndarray, below: np.ndarray) -> Interval:
    """Return the exponential of the mean difference of logarithms, with its interval."""
    logs = over_runs(above - below)
    return Interval(*np.exp([logs.value, logs.low, logs.high]).tolist())
