r"""Selfish and social players with plans, with eyes, and with training, in one environment.

Every game is a scenario, a speed set and a lam, with the objective ``risk``.  In the environment
(arrival within a region, inputs projected) a selfish and a social player of each kind play it:

    planned    ``nash``, ``social``                    plans, tracked: each sees its own state
    feedback   ``feedback-nash``, ``feedback-social``  dynamic programming; see all agents
    learned    ``ppo-selfish``, ``ppo-social``         five training runs each; see all agents

    price in cost   expected cost of the selfish player over that of the social one
    price in risk   the same ratio of the probability that any agent crashes
    regret          gain of an agent by the best response that dynamic programming finds

Episodes come in as many groups as learners have training runs; run r plays group r, and all players
meet the same noise.  Intervals of prices and of differences are Student's over the groups: for
learners they cover training and noise, for the others noise only.  Crash shares of a group below
1e-4 count as 1e-4.  Games of three agents have no feedback players and no regrets.
"""

from __future__ import annotations

from itertools import product

from benchmarks import sweeps
from benchmarks.studies.results import StudyRow
from benchmarks.studies.study import StudyChoice
from benchmarks.sweeps import Cell
from ppg_env.scenarios.make import make_game
from solvers.feedback.grid.extent import dynamic_programming_applies

KINDS = {
    "planned": ("nash", "social"),
    "feedback": ("feedback-nash", "feedback-social"),
    "learned": ("ppo-selfish", "ppo-social"),
}
"""Selfish and social player of each kind."""

PLAYERS = tuple(name for pair in KINDS.values() for name in pair)
SELFISH = tuple(selfish for selfish, _ in KINDS.values())
ORACLE = "feedback-social"

GROUPS = 5
"""Groups of episodes, as many as pretrained players have runs."""

REGRET_LAMS = (0.5,)
"""Values of lam at which regrets are measured: each takes two best responses, minutes."""

TIME_LIMIT = 1800.0
"""Seconds for each plan, feedback policy or best response, on a busy machine."""

KEPT = (
    "speed", "scenario", "lam", "player", "status", "episodes", "expected_cost",
    "expected_cost_low", "expected_cost_high", "crash_probability", "crash_probability_low",
    "crash_probability_high", "group_costs", "group_crashes", "play_regret",
)  # fmt: skip
"""Columns of a sweep's row that the study uses."""

SPREAD = ("expected_cost", "crash_probability")
"""Columns whose limits are those over training runs, for learners."""


def cells(choice: StudyChoice) -> list[Cell]:
    """Return the cells, by speed set first; feedback players only where they can be computed."""
    seeing = {name: dynamic_programming_applies(make_game(name)) for name in choice.scenarios}
    return [
        Cell(
            scenario,
            name,
            {"speed": speed, "objective": "risk", "lam": lam},
            "env",
            choice.episodes,
            GROUPS,
            "grid" if seeing[scenario] and name in SELFISH and lam in REGRET_LAMS else None,
            time_limit=TIME_LIMIT,
            seed=choice.seed,
        )
        for speed, scenario, lam in product(choice.speeds, choice.scenarios, choice.lams)
        for name in PLAYERS
        if seeing[scenario] or name not in KINDS["feedback"]
    ]


def digest(row: sweeps.Row) -> StudyRow:
    """Return the columns that the study uses, with limits that cover training, too."""
    kept: StudyRow = {name: getattr(row, name) for name in KEPT}
    for name in SPREAD if row.over_runs else ():
        runs, low, high = (row.over_runs or {})[name], f"{name}_low", f"{name}_high"
        kept |= {low: min(runs["low"], kept[low]), high: max(runs["high"], kept[high])}
    return kept
