r"""Tightness of the bounds on the crash probability.

Every cell is a plan, given by a scenario, a speed set, an objective, a gain, a lam and a player.
The certified bounds of :mod:`ppg_env.risk.union_bounds` on its crash probability are compared with
simulation, for the event of any overlap at the time steps:

    union >= faces >= instants >= tree >= Pr(crash),     counted = hits / episodes

This order is checked: the lower limits of the counts, which hold together with 95 % (Bonferroni),
are at most the tightest bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from benchmarks.studies.results import StudyRow
from benchmarks.studies.study import StudyChoice
from ppg_env.game.game import Game
from ppg_env.scenarios.make import make_game

OBJECTIVES = ("margin", "risk")
GAINS = (0.0, 0.5)
PLAYERS = ("nash", "social")

BOUNDS = ("union", "faces", "instants", "tree")
NAMES = ("the paper's bound", "best faces", "exact instants", "less shared")
"""Names of the bounds, from the paper's to the tightest."""

TIME_LIMIT = 120.0
"""Seconds for each plan; the status in the row shows whether it is proved."""

ENOUGH = 100
"""Least number of crashes for a bound to be compared with the count."""

CONFIDENCE = 0.95


@dataclass(frozen=True)
class BoundsCell:
    """One plan of the study."""

    scenario: str
    speed: str
    objective: str
    gain: float
    lam: float
    player: str

    def game(self) -> Game:
        """Return the game that is planned for and simulated."""
        return make_game(
            self.scenario,
            speed=self.speed,
            objective=self.objective,
            gain=self.gain,
            lam=self.lam,
        )


def cells(choice: StudyChoice) -> list[BoundsCell]:
    """Return all cells, by speed set first."""
    return [
        BoundsCell(scenario, speed, objective, gain, lam, player)
        for speed, scenario, objective, gain, lam, player in product(
            choice.speeds, choice.scenarios, OBJECTIVES, GAINS, choice.lams, PLAYERS
        )
    ]


def run_cell(cell: BoundsCell, episodes: int, seed: int) -> StudyRow:
    """Plan, bound and count; a row without ``bounds`` has the ``reason`` why there is no plan."""
    from benchmarks.comparison.players import entrant
    from ppg_env.risk.monte_carlo import crash_counts
    from ppg_env.risk.union_bounds import risk_bounds
    from ppg_env.support.statistics import proportion
    from solvers.planner_options import PlannerOptions

    game = cell.game()
    row: StudyRow = vars(cell) | {"episodes": episodes, "seed": seed}
    solution = entrant(cell.player, game, PlannerOptions(time_limit=TIME_LIMIT)).solution
    assert solution is not None
    if solution.profile is None:
        return row | {"reason": solution.advice}
    bounds = risk_bounds(game, solution.profile)
    hits = crash_counts(game, solution.profile, episodes, seed).any
    counted = proportion(hits, episodes, CONFIDENCE)
    return row | {
        "status": str(solution.status),
        "bounds": vars(bounds.any),
        "hits": hits,
        "low": counted.low,
        "high": counted.high,
    }
