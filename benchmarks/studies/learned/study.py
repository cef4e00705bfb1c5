r"""Do learned selfish agents pay the same price in safety as equilibrium planners?

Every cell is a scenario, a speed set and a lam.  In it four players meet the same noise in the
environment (arrival within a region, inputs projected): the tracked plans of ``nash`` and
``social``, planned for the risk objective, and the pretrained ``ppo-selfish`` and ``ppo-social``.

    price in cost   expected cost of the selfish player over that of the social one
    price in risk   probability that anybody crashes, likewise

Episodes come in as many groups as there are training runs; run r plays group r.  Intervals are
Student's over the groups: for learners they cover training and noise, for planners noise alone.
Logarithms of crash counts are taken with half a crash added.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from baselines.evaluate_runs import RunStatistics, evaluate_runs, over_runs
from baselines.pretrained import find_pretrained
from benchmarks.studies.results import Row, by_speed, probability
from benchmarks.studies.study import PAPER, SPEEDS, Choice, Study, Table
from ppg_env.env.players import Player, track
from ppg_env.game.game import Game
from ppg_env.scenarios.make import make_game
from ppg_env.support.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLAYERS = ("nash", "social", "ppo-selfish", "ppo-social")
KINDS = {"planned": ("nash", "social"), "learned": ("ppo-selfish", "ppo-social")}
"""Selfish and social player of each kind."""

RIVALS = {"ppo-selfish": "nash", "ppo-social": "social"}
"""Whom a learner is compared with, pair by pair."""

TIME_LIMIT = 120.0
"""Seconds for each plan; a row says by its status if that was not enough for a proof."""

SAME = 0.05
"""Costs within this share of each other count as about the same, as the paper has it."""


@dataclass(frozen=True)
class Cell:
    """One game of the study."""

    scenario: str
    speed: str
    lam: float

    def game(self) -> Game:
        """The game; its objective is what the planners plan for."""
        return make_game(self.scenario, speed=self.speed, lam=self.lam, objective="risk")


def cells(choice: Choice) -> list[Cell]:
    """All cells, speed sets first."""
    return [
        Cell(scenario, speed, lam)
        for speed, scenario, lam in product(choice.speeds, choice.scenarios, choice.lams)
    ]


def run_cell(cell: Cell, episodes: int, seed: int) -> Row:
    """Play one cell; a row of plain numbers.

    A row without ``players`` has the ``reason`` why a planner found nothing.
    """
    game = cell.game()
    row: Row = vars(cell) | {"episodes": episodes, "seed": seed}
    learned = {name: find_pretrained(name, game) for name in KINDS["learned"]}
    groups = len(learned["ppo-selfish"].runs)
    sides: dict[str, list[Sequence[Player]]] = {
        name: [one.players(game, run) for run in range(groups)] for name, one in learned.items()
    }
    for name in KINDS["planned"]:
        solution = _plan(name, game)
        if solution.profile is None:
            return row | {"reason": f"{name}: {solution.advice}"}
        row[f"{name}_status"] = str(solution.status)
        sides[name] = [track(game, solution.profile)]
    judged = {
        name: evaluate_runs(game, sides[name], episodes, seed, groups=groups) for name in PLAYERS
    }
    return row | {
        "players": {name: _figures(judged[name]) for name in PLAYERS},
        "paired": {
            name: vars(over_runs(judged[name].costs - judged[rival].costs))
            for name, rival in RIVALS.items()
        },
        "price": {kind: _price(judged[a], judged[b]) for kind, (a, b) in KINDS.items()},
    }


def _plan(name: str, game: Game) -> Any:
    from solvers import best_response_dynamics, social_optimum

    planner = best_response_dynamics if name == "nash" else social_optimum
    return planner(game, time_limit=TIME_LIMIT)


def _figures(judged: RunStatistics) -> dict[str, Any]:
    return {
        "cost": vars(over_runs(judged.costs, 0.0)),
        "crash": vars(_crash(judged)),
        "success": vars(over_runs(judged.successes, 0.0, 1.0)),
    }


def _crash(judged: RunStatistics) -> Interval:
    """Over the groups; where no crash was seen, up to the 97.5 % limit of all episodes."""
    found, seen = over_runs(judged.crashes, 0.0, 1.0), judged.summary.crash_any
    return found if seen.hits else Interval(0.0, 0.0, seen.high)


def _price(selfish: RunStatistics, social: RunStatistics) -> dict[str, Any]:
    count = len(selfish.groups[0].cost) + 0.5
    logs = [np.log(one.crashes + 0.5 / count) for one in (selfish, social)]
    return {
        "cost": vars(_ratio(np.log(selfish.costs), np.log(social.costs))),
        "risk": vars(_ratio(*logs)),
    }


def _ratio(above: np.ndarray, below: np.ndarray) -> Interval:
    """Exp of the mean difference of logarithms, with its interval."""
    found = over_runs(above - below)
    return Interval(*np.exp([found.value, found.low, found.high]).tolist())


def tables(rows: Sequence[Row]) -> Iterator[Table]:
    """A table for each speed set."""
    for speed, mine in by_speed(rows).items():
        yield Table(f"speed set {speed}", COLUMNS, _lines(mine), NOTE)


def _lines(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    lines = []
    for row in rows:
        head = (row["scenario"], f"{row['lam']:g}")
        if "players" not in row:
            lines.append((*head, row["reason"], *[""] * (len(COLUMNS) - 3)))
            continue
        played = [row["players"][name] for name in PLAYERS]
        lines.append(
            (
                *head,
                *(f"{one['cost']['value']:.2f}" for one in played),
                *(probability(one["crash"]["value"], row["episodes"]) for one in played),
                *(
                    f"{row['price'][kind][what]['value']:{form}}"
                    for what, form in (("cost", ".3f"), ("risk", ".3g"))
                    for kind in KINDS
                ),
            )
        )
    return lines


NOTE = (
    "Cost: lam per step and (1 - lam) 100 for a crash, mean over agents. Crash: anybody. self*, "
    "soc.*: ppo-selfish, ppo-social. Ratio: selfish over social, planned and learned*."
)

SHORT = ("nash", "soc.", "self*", "soc.*")
"""Names of the players in the head of the table."""

COLUMNS = (
    "scenario",
    "lam",
    *(f"{what}\n{name}" for what in ("cost", "crash") for name in SHORT),
    *(f"{what}\nratio\n{kind}" for what in ("cost", "risk") for kind in ("pl.", "le.*")),
)


def words(rows: Sequence[Row]) -> Iterator[str]:
    """What the rows say, in sentences that the data write."""
    rows = [row for row in rows if "players" in row]
    for kind, (selfish, social) in KINDS.items():
        ratios = {what: [row["price"][kind][what] for row in rows] for what in ("cost", "risk")}
        values = {what: np.array([r["value"] for r in found]) for what, found in ratios.items()}
        same = [abs(r["value"] - 1) <= SAME for r in ratios["cost"]]
        worse = [r["low"] > 1 for r in ratios["risk"]]
        safer = [r["high"] < 1 for r in ratios["risk"]]
        both = sum(a and b for a, b in zip(same, worse, strict=True))
        yield (
            f"{kind.capitalize()} ({selfish} against {social}): costs differ by at most "
            f"{SAME:.0%} in {sum(same)} of {len(rows)} cells (ratio {values['cost'].min():.3f} to "
            f"{values['cost'].max():.3f}); crashes are likelier in {sum(worse)} cells, less likely "
            f"in {sum(safer)}, and not told apart in {len(rows) - sum(worse) - sum(safer)} "
            f"(median ratio {np.median(values['risk']):.2g}, largest {values['risk'].max():.3g}). "
            f"As the paper has it, about as cheap and less safe: {both} cells."
        )
        yield f"{kind.capitalize()}, by scenario and speed set: {_places(rows, kind)}."
        yield (
            f"{kind.capitalize()}, against the paper: costs further apart than {SAME:.0%} in "
            f"{_named(rows, [not one for one in same])}; selfish the safer one in "
            f"{_named(rows, safer)}."
        )
    for name, rival in RIVALS.items():
        paired = [row["paired"][name] for row in rows]
        cheaper = sum(p["high"] < 0 for p in paired)
        dearer = [p["low"] > 0 for p in paired]
        yield (
            f"{name} against tracked {rival}, same noise: cheaper in {cheaper} of {len(rows)} "
            f"cells, not told apart in {len(rows) - cheaper - sum(dearer)}, dearer in "
            f"{_named(rows, dearer)}."
        )


def _named(rows: Sequence[Row], marked: Sequence[bool]) -> str:
    """How many cells are marked, and which."""
    names = [
        f"{row['scenario']} {row['speed']} {row['lam']:g}"
        for row, mark in zip(rows, marked, strict=True)
        if mark
    ]
    plural = "s" if len(names) > 1 else ""
    return f"{len(names)} cell{plural} ({', '.join(names)})" if names else "no cell"


def _places(rows: Sequence[Row], kind: str) -> str:
    """Where selfishness makes crashes likelier, and at how many lam of how many."""
    found: dict[str, tuple[int, int]] = {}
    for row in rows:
        key = f"{row['scenario']} {row['speed']}"
        hits, total = found.get(key, (0, 0))
        found[key] = (hits + (row["price"][kind]["risk"]["low"] > 1), total + 1)
    return "crashes likelier at " + ", ".join(
        f"{key} {hits}/{total}" for key, (hits, total) in found.items()
    )


def draw(rows: Sequence[Row]) -> Mapping[str, Figure]:
    """A figure for each speed set."""
    from benchmarks.studies.learned.figure import draw_speed

    return {speed: draw_speed(mine, speed) for speed, mine in by_speed(rows).items()}


STUDY = Study(
    "learned",
    "Do learned selfish agents pay the same price in safety as equilibrium planners?",
    Choice(PAPER, SPEEDS, (0.1, 0.3, 0.5, 0.7, 0.8, 0.9), episodes=250_000),
    cells,
    tables,
    words,
    draw,
    run=run_cell,
)
