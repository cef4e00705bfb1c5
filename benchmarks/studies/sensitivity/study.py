"""Tables, sentences and figures of the study ``sensitivity``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from benchmarks.studies.prices import (
    EQUILIBRIA,
    SAME,
    SUMMARY,
    Price,
    digest,
    missing,
    sides,
    summary,
    summary_note,
)
from benchmarks.studies.results import StudyRow, crash_event
from benchmarks.studies.sensitivity.data import AXES, by_level, cells
from benchmarks.studies.sensitivity.figure import draw_levels
from benchmarks.studies.study import PAPER, Study, StudyChoice, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = (
    "How far do cost gap and risk ratio depend on the cap M', the horizon, the square root of two "
    "and the speed set?"
)
CHOICE = StudyChoice(PAPER, ("l1", "disc", "box"), (0.5, 0.8, 0.9), episodes=100_000)

COLUMNS = ("level", "scenario", *SUMMARY)


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield a table of all scenarios together, and one of each scenario."""
    compared = {name: by_level(rows, name) for name in EQUILIBRIA}
    scenarios = list(dict.fromkeys(row["scenario"] for row in rows))
    whole, each = [], []
    for level in dict.fromkeys(level for some in compared.values() for level in some):
        here = {name: some.get(level, []) for name, some in compared.items()}
        count = len({price.selfish["scenario"] for some in here.values() for price in some})
        whole.append((level, f"all {count}", *summary(here)))
        each += [(level, name, *summary(_of(name, here))) for name in scenarios]
    note = summary_note(rows)
    yield Table("Levels of each factor", COLUMNS, whole, note, texts=2)
    yield Table("Levels of each factor, by scenario", COLUMNS, each, note, texts=2)


def _of(scenario: str, chosen: Mapping[str, list[Price]]) -> dict[str, list[Price]]:
    return {
        name: [price for price in some if price.selfish["scenario"] == scenario]
        for name, some in chosen.items()
    }


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield sentences on the rows."""
    for name in EQUILIBRIA:
        levels = by_level(rows, name)
        for what, describe in PHRASES.items():
            listed = ", ".join(f"{level} {describe(chosen)}" for level, chosen in levels.items())
            yield f"{name}, {what}: {listed or 'no game'}."
    yield from missing(rows)


def _gap(chosen: Sequence[Price]) -> str:
    return f"{sum(price.cost - 1 for price in chosen) / len(chosen):.1%}"


def _crashes(chosen: Sequence[Price]) -> str:
    both = ([price.selfish for price in chosen], [price.social for price in chosen])
    means = (sum(row["crash_probability"] for row in some) / len(some) for some in both)
    return " / ".join(f"{mean:.1e}" for mean in means)


def _as_the_paper(chosen: Sequence[Price]) -> str:
    return str(sum(price.same_cost and price.riskier for price in chosen))


PHRASES: dict[str, Callable[[Sequence[Price]], str]] = {
    "mean cost gap": _gap,
    "significantly riskier / safer than the optimum": lambda some: f"{sides(some)} of {len(some)}",
    f"riskier and within {SAME:.0%} of the optimum's cost, as the paper claims": _as_the_paper,
    "mean crash probability, and that of the optimum": _crashes,
}
"""Titles and values of the sentences on all levels."""


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw cost and risk ratios at every level."""
    levels = {name: by_level(rows, name) for name in EQUILIBRIA}
    return {"": draw_levels(levels, crash_event(rows))}


STUDY = Study(
    "sensitivity", QUESTION, CHOICE, cells, tables, words, draw, digest=partial(digest, axes=AXES)
)
