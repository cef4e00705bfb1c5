"""Tables, sentences and figures of the study ``learned``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.studies.learned.data import KINDS, PLAYERS, RIVALS, SAME, cells, run_cell
from benchmarks.studies.learned.figure import draw_speed
from benchmarks.studies.results import StudyRow, by_speed, probability
from benchmarks.studies.study import PAPER, SPEEDS, Study, StudyChoice, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
QUESTION = "Do learned selfish agents pay the same price in safety as equilibrium planners?"
CHOICE = StudyChoice(PAPER, SPEEDS, (0.1, 0.3, 0.5, 0.7, 0.8, 0.9), episodes=250_000)


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield a table for each speed set."""
    for speed, chosen in by_speed(rows).items():
        yield Table(f"speed set {speed}", COLUMNS, _lines(chosen), NOTE)


def _lines(rows: Sequence[StudyRow]) -> list[tuple[str, ...]]:
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
                *(f"{player['cost']['value']:.2f}" for player in played),
                *(probability(player["crash"]["value"], row["episodes"]) for player in played),
                *(
                    f"{row['price'][kind][what]['value']:{form}}"
                    for what, form in (("cost", ".3f"), ("risk", ".3g"))
                    for kind in KINDS
                ),
            )
        )
    return lines


NOTE = (
    "Cost: lam per step and (1 - lam) 100 for a crash, mean over agents. Crash: Pr(any overlap at "
    "the time steps). self*, soc.*: ppo-selfish, ppo-social. Ratio: selfish over social, planned "
    "and learned*."
)

SHORT = ("nash", "soc.", "self*", "soc.*")
"""Names of the players in the head of the table."""

COLUMNS = (
    "scenario",
    "lam",
    *(f"{what}\n{name}" for what in ("cost", "crash") for name in SHORT),
    *(f"{what}\nratio\n{kind}" for what in ("cost", "risk") for kind in ("pl.", "le.*")),
)


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield sentences on the rows."""
    rows = [row for row in rows if "players" in row]
    for kind, (selfish, social) in KINDS.items():
        ratios = {what: [row["price"][kind][what] for row in rows] for what in ("cost", "risk")}
        values = {what: np.array([r["value"] for r in some]) for what, some in ratios.items()}
        same = [abs(r["value"] - 1) <= SAME for r in ratios["cost"]]
        worse = [r["low"] > 1 for r in ratios["risk"]]
        safer = [r["high"] < 1 for r in ratios["risk"]]
        both = sum(a and b for a, b in zip(same, worse, strict=True))
        yield (
            f"{kind.capitalize()} ({selfish} compared with {social}): costs differ by at most "
            f"{SAME:.0%} in {sum(same)} of {len(rows)} cells (ratio {values['cost'].min():.3f} to "
            f"{values['cost'].max():.3f}); crashes are significantly more likely in {sum(worse)} "
            f"cells, less likely in {sum(safer)}, no significant difference in "
            f"{len(rows) - sum(worse) - sum(safer)} (median ratio "
            f"{np.median(values['risk']):.2g}, largest {values['risk'].max():.3g}). About the same "
            f"cost and less safe, as the paper claims: {both} cells."
        )
        yield f"{kind.capitalize()}, by scenario and speed set: {_places(rows, kind)}."
        yield (
            f"{kind.capitalize()}, unlike the paper: costs differ by more than {SAME:.0%} in "
            f"{_named(rows, [not equal for equal in same])}; selfish players are safer in "
            f"{_named(rows, safer)}."
        )
    for name, rival in RIVALS.items():
        paired = [row["paired"][name] for row in rows]
        cheaper = sum(p["high"] < 0 for p in paired)
        costlier = [p["low"] > 0 for p in paired]
        yield (
            f"{name} compared with tracked {rival}, same noise: cheaper in {cheaper} of "
            f"{len(rows)} cells, no significant difference in "
            f"{len(rows) - cheaper - sum(costlier)}, costlier in {_named(rows, costlier)}."
        )


def _named(rows: Sequence[StudyRow], marked: Sequence[bool]) -> str:
    """Return the number of marked cells, with their names."""
    names = [
        f"{row['scenario']} {row['speed']} {row['lam']:g}"
        for row, mark in zip(rows, marked, strict=True)
        if mark
    ]
    plural = "s" if len(names) > 1 else ""
    return f"{len(names)} cell{plural} ({', '.join(names)})" if names else "no cell"


def _places(rows: Sequence[StudyRow], kind: str) -> str:
    """Return the places where selfish players crash more, with counts of lam."""
    counts: dict[str, tuple[int, int]] = {}
    for row in rows:
        key = f"{row['scenario']} {row['speed']}"
        hits, total = counts.get(key, (0, 0))
        counts[key] = (hits + (row["price"][kind]["risk"]["low"] > 1), total + 1)
    return "crashes significantly more likely at " + ", ".join(
        f"{key} {hits}/{total}" for key, (hits, total) in counts.items()
    )


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw a figure for each speed set."""
    return {speed: draw_speed(chosen, speed) for speed, chosen in by_speed(rows).items()}


STUDY = Study("learned", QUESTION, CHOICE, cells, tables, words, draw, run=run_cell)
