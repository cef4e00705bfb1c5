"""How far the price of selfish risk depends on what the paper fixes or leaves open.

One factor at a time is changed, around the paper's objective and cap:

    base   margin_cap 3, horizon 15, scale exact (with the square root of two), no feedback, and
           the first speed set

The factors are the cap M', the horizon, the scale of margins (the paper's programs drop the square
root of two) and the speed set.  Levels of a factor are games of their own, with costs of their
own: compared are ratios, as :mod:`benchmarks.studies.prices` defines them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

from benchmarks.studies.prices import (
    EQUILIBRIA,
    NOTE,
    PLAYERS,
    SAME,
    SUMMARY,
    Price,
    digest,
    missing,
    prices,
    sides,
    summary,
)
from benchmarks.studies.results import Row
from benchmarks.studies.study import OUT_OF_REACH, PAPER, Choice, Study, Table
from benchmarks.sweeps import Cell

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CAPS, HORIZONS, SCALES = (3.0, 2.0, 5.0, 8.0), (15, 20), ("exact", "paper")
"""Levels of the factors; the first is that of the base."""

AXES = ("scenario", "lam", "margin_cap", "horizon", "scale", "speed")
FACTORS = AXES[2:]
SIGNS = {"margin_cap": "M' = ", "horizon": "horizon ", "scale": "scale ", "speed": "speed "}
BASE = "base"

Levels = dict[str, list[Price]]
"""Prices by the name of the level."""


def cells(choice: Choice) -> list[Cell]:
    """Three players in every game of every level."""
    return [
        Cell(
            scenario,
            player,
            {**level, "objective": "margin", "gain": 0.0, "lam": lam},
            episodes=choice.episodes,
            seed=choice.seed,
        )
        for level in levels(choice.speeds)
        for scenario, lam, player in product(choice.scenarios, choice.lams, PLAYERS)
        if (scenario, level["margin_cap"]) not in OUT_OF_REACH
    ]


def levels(speeds: Sequence[str]) -> list[dict[str, Any]]:
    """The base, and then the base with another level of one factor."""
    known = dict(zip(FACTORS, (CAPS, HORIZONS, SCALES, speeds), strict=True))
    base = {factor: values[0] for factor, values in known.items()}
    others = ((factor, value) for factor, values in known.items() for value in values[1:])
    return [base, *(base | {factor: value} for factor, value in others)]


def by_level(rows: Sequence[Row], player: str) -> Levels:
    """Prices of the equilibria of ``player``, the base first."""
    found = prices(rows, player, AXES)
    named: Levels = {}
    for one in found:
        changed = [f for f in FACTORS if one.selfish[f] != found[0].selfish[f]]
        name = ", ".join(f"{SIGNS[f]}{_plain(one.selfish[f])}" for f in changed) or BASE
        named.setdefault(name, []).append(one)
    return named


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


COLUMNS = ("level", "scenario", *SUMMARY)


def tables(rows: Sequence[Row]) -> Iterator[Table]:
    """All scenarios together, and then each."""
    found = {name: by_level(rows, name) for name in EQUILIBRIA}
    scenarios = list(dict.fromkeys(row["scenario"] for row in rows))
    whole, each = [], []
    for level in dict.fromkeys(level for some in found.values() for level in some):
        here = {name: some.get(level, []) for name, some in found.items()}
        count = len({one.selfish["scenario"] for some in here.values() for one in some})
        whole.append((level, f"all {count}", *summary(here)))
        each += [(level, one, *summary(_of(one, here))) for one in scenarios]
    yield Table("Levels of each factor", COLUMNS, whole, NOTE, texts=2)
    yield Table("Levels of each factor, by scenario", COLUMNS, each, NOTE, texts=2)


def _of(scenario: str, chosen: Mapping[str, list[Price]]) -> dict[str, list[Price]]:
    return {
        name: [one for one in some if one.selfish["scenario"] == scenario]
        for name, some in chosen.items()
    }


def words(rows: Sequence[Row]) -> Iterator[str]:
    """What the rows say, in sentences that the data write."""
    for name in EQUILIBRIA:
        found = by_level(rows, name)
        for what, tell in TOLD.items():
            listed = ", ".join(f"{level} {tell(chosen)}" for level, chosen in found.items())
            yield f"{name}, {what}: {listed or 'no game'}."
    yield from missing(rows)


def _gap(chosen: Sequence[Price]) -> str:
    return f"{sum(one.cost - 1 for one in chosen) / len(chosen):.1%}"


def _crashes(chosen: Sequence[Price]) -> str:
    both = ([one.selfish for one in chosen], [one.social for one in chosen])
    means = (sum(row["crash_probability"] for row in some) / len(some) for some in both)
    return " / ".join(f"{mean:.1e}" for mean in means)


def _as_the_paper(chosen: Sequence[Price]) -> str:
    return str(sum(one.same_cost and one.riskier for one in chosen))


TOLD: dict[str, Callable[[Sequence[Price]], str]] = {
    "mean cost gap": _gap,
    "riskier / safer than the optimum beyond doubt": lambda some: f"{sides(some)} of {len(some)}",
    f"riskier and within {SAME:.0%} of the optimum's cost, as the paper has it": _as_the_paper,
    "mean crash probability, and that of the optimum": _crashes,
}
"""What is told of every level."""


def draw(rows: Sequence[Row]) -> Mapping[str, Figure]:
    """One figure."""
    from benchmarks.studies.sensitivity.figure import draw_levels

    return {"": draw_levels({name: by_level(rows, name) for name in EQUILIBRIA})}


STUDY = Study(
    "sensitivity",
    "How far do cost gap and risk ratio depend on the cap M', the horizon, the square root of two "
    "and the speed set?",
    Choice(PAPER, ("l1", "disc", "box"), (0.5, 0.8, 0.9), episodes=100_000),
    cells,
    tables,
    words,
    draw,
    digest=partial(digest, axes=AXES),
)
