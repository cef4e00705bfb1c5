"""Tables, sentences and figures of the study ``learned``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.studies.learned.data import KINDS, PLAYERS, RIVALS, SAME, cells, run_cell
from benchmarks.studies.learned.figure import draw_speed
from benchmarks.studies.results import StudyRow, by_speed, probability
from benchmarks.studies.study import PAPER, SPEEDS, Choice, Study, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
QUESTION = "Do learned selfish agents pay the same price in safety as equilibrium planners?"
CHOICE = Choice(PAPER, SPEEDS, (0.1, 0.3, 0.5, 0.7, 0.8, 0.9), episodes=250_000)


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """A table for each speed set."""
    for speed, mine in by_speed(rows).items():
        yield Table(f"speed set {speed}", COLUMNS, _lines(mine), NOTE)


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


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
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


def _named(rows: Sequence[StudyRow], marked: Sequence[bool]) -> str:
    """How many cells are marked, and which."""
    names = [
        f"{row['scenario']} {row['speed']} {row['lam']:g}"
        for row, mark in zip(rows, marked, strict=True)
        if mark
    ]
    plural = "s" if len(names) > 1 else ""
    return f"{len(names)} cell{plural} ({', '.join(names)})" if names else "no cell"


def _places(rows: Sequence[StudyRow], kind: str) -> str:
    """Where selfishness makes crashes likelier, and at how many lam of how many."""
    found: dict[str, tuple[int, int]] = {}
    for row in rows:
        key = f"{row['scenario']} {row['speed']}"
        hits, total = found.get(key, (0, 0))
        found[key] = (hits + (row["price"][kind]["risk"]["low"] > 1), total + 1)
    return "crashes likelier at " + ", ".join(
        f"{key} {hits}/{total}" for key, (hits, total) in found.items()
    )


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """A figure for each speed set."""
    return {speed: draw_speed(mine, speed) for speed, mine in by_speed(rows).items()}


STUDY = Study("learned", QUESTION, CHOICE, cells, tables, words, draw, run=run_cell)
