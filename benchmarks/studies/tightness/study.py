"""Tables, sentences and figures of the study ``tightness``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.studies.results import StudyRow, by_speed, crash_event, probability
from benchmarks.studies.study import PAPER, Study, StudyChoice, Table
from benchmarks.studies.tightness.data import BOUNDS, CONFIDENCE, ENOUGH, NAMES, cells, run_cell
from benchmarks.studies.tightness.figure import draw_speed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = "How tight are the bounds on the crash probability?"
CHOICE = StudyChoice(PAPER, ("l1",), (0.5, 0.8), episodes=1_000_000)

COLUMNS = (
    "scenario", "objective", "gain", "lam", "player", "paper's\nbound", "best\nfaces",
    "exact\ninstants", "less\nshared", "counted", "paper's /\nless shared",
)  # fmt: skip
NOTE = (
    "Probability of any {event}: certified upper bounds, and the share of {episodes:,} "
    "episodes. Paper's bound: margins capped; best faces: the same without the cap; exact "
    "instants: sum of exact probabilities; less shared: minus the overlap of pairs of events."
)


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield a table for each speed set."""
    for speed, chosen in by_speed(rows).items():
        most = max(row["episodes"] for row in chosen)
        lines = [_line(row) for row in chosen]
        yield Table(
            f"speed set {speed}",
            COLUMNS,
            lines,
            NOTE.format(event=crash_event(rows), episodes=most),
        )


def _line(row: StudyRow) -> tuple[str, ...]:
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


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield sentences on the rows."""
    rows = [row for row in rows if "bounds" in row]
    broken = [row for row in rows if _lowest(row, len(rows)) > row["bounds"]["tree"]]
    yield (
        f"Order: the count's lower limit (95 % for all plans together) is at most the tightest "
        f"bound in {len(rows) - len(broken)} of {len(rows)} plans."
    )
    counted = [row for row in rows if row["hits"] >= ENOUGH]
    for name, what in zip(BOUNDS, NAMES, strict=True):
        ratios = [row["bounds"][name] * row["episodes"] / row["hits"] for row in counted]
        if ratios:
            yield (
                f"{what[0].upper()}{what[1:]}: {np.median(ratios):.3g} times the count in the "
                f"median plan of {len(counted)} with {ENOUGH} crashes or more, {min(ratios):.3g} "
                f"to {max(ratios):.3g}."
            )
    gaps = {row["scenario"]: 0.0 for row in rows}
    for row in rows:
        ratio = row["bounds"]["union"] / row["bounds"]["tree"]
        gaps[row["scenario"]] = max(gaps[row["scenario"]], ratio)
    listed = ", ".join(f"{name} {_ratio(ratio)}" for name, ratio in gaps.items())
    yield f"The paper's bound over the tightest one, at most: {listed}."


def _lowest(row: StudyRow, plans: int) -> float:
    """Return the lower limit of a count; the limits of all ``plans`` hold together."""
    from ppg_env.support.statistics import proportion

    return proportion(row["hits"], row["episodes"], 1 - (1 - CONFIDENCE) / plans).low


def _ratio(value: float) -> str:
    return f"{value:.3g}" if value < 1e4 else f"{value:.0e}".replace("e+", "e")


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw a figure for each speed set."""
    return {
        speed: draw_speed(chosen, speed, crash_event(rows))
        for speed, chosen in by_speed(rows).items()
    }


STUDY = Study("tightness", QUESTION, CHOICE, cells, tables, words, draw, run=run_cell)
