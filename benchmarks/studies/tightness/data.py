r"""How tight are the bounds on the crash probability?

Every cell is a plan: a scenario, a speed set, an objective, a gain, a lam, and who planned.  On it
the certified bounds of :mod:`ppg_env.risk.union_bounds` meet simulation, for the event that anybody
crashes:

    union >= faces >= instants >= tree >= Pr(crash),     counted = hits / episodes

The order has to hold, and is checked: lower limits of the counts that all hold together with 95 %
(Bonferroni) are at most the tightest bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from benchmarks.studies.results import StudyRow
from benchmarks.studies.study import Choice
from ppg_env.game.game import Game
from ppg_env.scenarios.make import make_game

OBJECTIVES = ("margin", "risk")
GAINS = (0.0, 0.5)
PLAYERS = ("nash", "social")

BOUNDS = ("union", "faces", "instants", "tree")
NAMES = ("the paper's bound", "best faces", "exact instants", "less shared")
"""From the paper's to the tightest, and what they are called."""

TIME_LIMIT = 120.0
"""Seconds for each plan; a row says by its status if that was not enough for a proof."""

ENOUGH = 100
"""Crashes that have to be seen before a bound is held against the count."""

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
        """The game that is planned for and played."""
        return make_game(
            self.scenario,
            speed=self.speed,
            objective=self.objective,
            gain=self.gain,
            lam=self.lam,
        )


def cells(choice: Choice) -> list[BoundsCell]:
    """All cells, speed sets first."""
    return [
        BoundsCell(scenario, speed, objective, gain, lam, player)
        for speed, scenario, objective, gain, lam, player in product(
            choice.speeds, choice.scenarios, OBJECTIVES, GAINS, choice.lams, PLAYERS
        )
    ]


def run_cell(cell: BoundsCell, episodes: int, seed: int) -> StudyRow:
    """Plan, bound and count; a row without ``bounds`` has the ``reason`` why there is no plan."""
    from benchmarks.comparison.planner_options import PlannerOptions
    from benchmarks.comparison.players import entrant
    from ppg_env.risk.monte_carlo import crash_counts
    from ppg_env.risk.union_bounds import risk_bounds
    from ppg_env.support.statistics import proportion

    game = cell.game()
    row: StudyRow = vars(cell) | {"episodes": episodes, "seed": seed}
    solution = entrant(cell.player, game, PlannerOptions(time_limit=TIME_LIMIT)).solution
    assert solution is not None
    if solution.profile is None:
        return row | {"reason": solution.advice}
    found = risk_bounds(game, solution.profile)
    hits = crash_counts(game, solution.profile, episodes, seed).any
    counted = proportion(hits, episodes, CONFIDENCE)
    return row | {
        "status": str(solution.status),
        "bounds": vars(found.any),
        "hits": hits,
        "low": counted.low,
        "high": counted.high,
    }
