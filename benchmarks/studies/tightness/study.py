r"""How tight are the bounds on the crash probability?

Every cell is a plan: a scenario, a speed set, an objective, a gain, a lam, and who planned.  On it
the certified bounds of :mod:`ppg_env.risk.union_bounds` meet simulation, for the event that anybody
crashes:

    union >= faces >= instants >= tree >= Pr(crash),     counted = hits / episodes

The order has to hold, and is checked: lower limits of the counts that all hold together with 95 %
(Bonferroni) are at most the tightest bounds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.studies.results import Row, by_speed, probability
from benchmarks.studies.study import PAPER, Choice, Study, Table
from ppg_env.game.game import Game
from ppg_env.scenarios.make import make_game

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
class Cell:
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


def cells(choice: Choice) -> list[Cell]:
    """All cells, speed sets first."""
    return [
        Cell(scenario, speed, objective, gain, lam, player)
        for speed, scenario, objective, gain, lam, player in product(
            choice.speeds, choice.scenarios, OBJECTIVES, GAINS, choice.lams, PLAYERS
        )
    ]


def run_cell(cell: Cell, episodes: int, seed: int) -> Row:
    """Plan, bound and count; a row without ``bounds`` has the ``reason`` why there is no plan."""
    from benchmarks.comparison.planner_options import PlannerOptions
    from benchmarks.comparison.players import entrant
    from ppg_env.risk.monte_carlo import crash_counts
    from ppg_env.risk.union_bounds import risk_bounds
    from ppg_env.support.statistics import proportion

    game = cell.game()
    row: Row = vars(cell) | {"episodes": episodes, "seed": seed}
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


COLUMNS = (
    "scenario",
    "objective",
    "gain",
    "lam",
    "player",
    "paper's\nbound",
    "best\nfaces",
    "exact\ninstants",
    "less\nshared",
    "counted",
    "paper's /\nless shared",
)
NOTE = (
    "Probability that anybody crashes: certified upper bounds, and the share of {episodes:,} "
    "episodes. Paper's bound: margins capped; best faces: the same without the cap; exact "
    "instants: sum of exact probabilities; less shared: less what pairs of events share."
)


def tables(rows: Sequence[Row]) -> Iterator[Table]:
    """A table for each speed set."""
    for speed, chosen in by_speed(rows).items():
        most = max(row["episodes"] for row in chosen)
        lines = [_line(row) for row in chosen]
        yield Table(f"speed set {speed}", COLUMNS, lines, NOTE.format(episodes=most))


def _line(row: Row) -> tuple[str, ...]:
    head = (row["scenario"], row["objective"], f"{row['gain']:g}", f"{row['lam']:g}", row["player"])
    if "bounds" not in row:
        return (*head, row["reason"], *[""] * (len(COLUMNS) - len(head) - 1))
    bounds = row["bounds"]
    return (
        *head,
        *(f"{bounds[name]:.1e}".replace("e-0", "e-") for name in BOUNDS),
        probability(row["hits"] / row["episodes"], row["episodes"]),
        _ratio(bounds["union"] / bounds["tree"]),
    )


def words(rows: Sequence[Row]) -> Iterator[str]:
    """What the rows say, in sentences that the data write."""
    rows = [row for row in rows if "bounds" in row]
    broken = [row for row in rows if _lowest(row, len(rows)) > row["bounds"]["tree"]]
    yield (
        f"Order: the count's lower limit (95 % for all plans together) is at most the tightest "
        f"bound in {len(rows) - len(broken)} of {len(rows)} plans."
    )
    seen = [row for row in rows if row["hits"] >= ENOUGH]
    for name, what in zip(BOUNDS, NAMES, strict=True):
        ratios = [row["bounds"][name] * row["episodes"] / row["hits"] for row in seen]
        if ratios:
            yield (
                f"{what[0].upper()}{what[1:]}: {np.median(ratios):.3g} times the count in the "
                f"median plan of {len(seen)} with {ENOUGH} crashes or more, {min(ratios):.3g} to "
                f"{max(ratios):.3g}."
            )
    gaps = {row["scenario"]: 0.0 for row in rows}
    for row in rows:
        ratio = row["bounds"]["union"] / row["bounds"]["tree"]
        gaps[row["scenario"]] = max(gaps[row["scenario"]], ratio)
    listed = ", ".join(f"{name} {_ratio(ratio)}" for name, ratio in gaps.items())
    yield f"The paper's bound over the tightest one, at most: {listed}."


def _lowest(row: Row, plans: int) -> float:
    """Lower limit of a count; those of so many ``plans`` hold together."""
    from ppg_env.support.statistics import proportion

    return proportion(row["hits"], row["episodes"], 1 - (1 - CONFIDENCE) / plans).low


def _ratio(value: float) -> str:
    return f"{value:.3g}" if value < 1e4 else f"{value:.0e}".replace("e+", "e")


def draw(rows: Sequence[Row]) -> Mapping[str, Figure]:
    """A figure for each speed set."""
    from benchmarks.studies.tightness.figure import draw_speed

    return {speed: draw_speed(mine, speed) for speed, mine in by_speed(rows).items()}


STUDY = Study(
    "tightness",
    "How tight are the bounds on the crash probability?",
    Choice(PAPER, ("l1",), (0.5, 0.8), episodes=1_000_000),
    cells,
    tables,
    words,
    draw,
    run=run_cell,
)
