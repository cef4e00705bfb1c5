"""Tables, sentences and figures of the study ``price``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from operator import itemgetter
from typing import TYPE_CHECKING

from benchmarks.studies.price.data import AXES, cells, family
from benchmarks.studies.price.figure import draw_speed
from benchmarks.studies.prices import (
    EQUILIBRIA,
    SUMMARY,
    Price,
    digest,
    missing,
    prices,
    riskiest,
    sides,
    summary,
    summary_note,
    verdict,
)
from benchmarks.studies.results import NEGLIGIBLE, StudyRow, chance, crash_event, grouped
from benchmarks.studies.study import PAPER, Study, StudyChoice, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = "Equilibria cost little more than the optimum: how much more do they risk?"
CHOICE = StudyChoice(PAPER, ("l1", "disc"), (0.1, 0.3, 0.5, 0.7, 0.8, 0.9), episodes=100_000)

FAMILIES = ("scenario", "objective", "gain", *SUMMARY)
SIGNIFICANT = (
    "scenario", "speed", "objective", "equilibrium", "gain", "lam", "cost\nratio", "crash\nequil.",
    "crash\noptimum", "risk\nratio", "at least", "bound\nratio",
)  # fmt: skip


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield a table of families for each speed set, and one of all games whose risks differ."""
    compared = {name: prices(rows, name, AXES) for name in EQUILIBRIA}
    families = {name: grouped(some, family) for name, some in compared.items()}
    games = max((len(some) for some in families[EQUILIBRIA[0]].values()), default=0)
    for speed, keys in grouped(families[EQUILIBRIA[0]], itemgetter(0)).items():
        lines = [
            (
                *key[1:3],
                f"{key[3]:g}",
                *summary({n: some.get(key, []) for n, some in families.items()}),
            )
            for key in keys
        ]
        title = f"Speed set {speed}, games over {games} values of lam"
        yield Table(title, FAMILIES, lines, summary_note(rows), texts=2)
    lines = [
        _line(name, price) for name in EQUILIBRIA for price in compared[name] if price.significant
    ]
    yield Table(
        "All games whose risks differ significantly",
        SIGNIFICANT,
        lines,
        f"Crash: Pr(any {crash_event(rows)}); in risk ratios, values below {NEGLIGIBLE:g} count "
        f"as {NEGLIGIBLE:g}. At least: lower limit of the risk ratio. Bound ratio: of the union "
        "bounds.",
        texts=4,
    )


def _line(name: str, price: Price) -> tuple[str, ...]:
    game = price.selfish
    return (
        game["scenario"],
        game["speed"],
        game["objective"],
        name,
        f"{game['gain']:g}",
        f"{game['lam']:g}",
        f"{price.cost:.3f}",
        chance(price.selfish),
        chance(price.social),
        f"{price.risk:.3g}",
        f"{price.least:.3g}",
        "-" if price.bound is None else f"{price.bound:.3g}",
    )


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield sentences on the rows."""
    for name in EQUILIBRIA:
        compared = prices(rows, name, AXES)
        if not compared:
            continue
        yield verdict(compared, name)
        worst, costliest = riskiest(compared), max(compared, key=lambda price: price.cost)
        if worst.riskier:
            yield (
                f"{name}, riskiest: risk ratio {worst.risk:.3g} (at least {worst.least:.3g}) at "
                f"a cost ratio of {worst.cost:.3f}, in {_named(worst)}."
            )
        yield f"{name}, costliest: cost ratio {costliest.cost:.3f}, in {_named(costliest)}."
        yield f"{name}, riskier / safer: {'; '.join(_by_axis(compared))}."
        significant = [price for price in compared if price.significant]
        bounded = [(p.bound, p.riskier) for p in significant if p.bound is not None]
        right = sum((bound > 1) == riskier for bound, riskier in bounded)
        if bounded:
            yield (
                f"{name}: where the risks differ significantly, the union bounds have the same "
                f"order in {right} of {len(bounded)} games."
            )
    yield from missing(rows)


def _named(price: Price) -> str:
    game = price.selfish
    return (
        f"{game['scenario']} ({game['speed']}, {game['objective']}, gain {game['gain']:g}, "
        f"lam {game['lam']:g})"
    )


def _by_axis(compared: Sequence[Price]) -> Iterator[str]:
    """Yield the numbers of riskier and safer games, for every value of every axis."""
    for axis in AXES:
        values = dict.fromkeys(price.selfish[axis] for price in compared)
        some = {value: [p for p in compared if p.selfish[axis] == value] for value in values}
        counts = (f"{value} {sides(own)} of {len(own)}" for value, own in some.items())
        yield f"by {axis} {', '.join(counts)}"


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw a figure for each speed set."""
    families = {name: grouped(prices(rows, name, AXES), family) for name in EQUILIBRIA}
    speeds = dict.fromkeys(key[0] for key in families["nash"])
    return {speed: draw_speed(families, speed, crash_event(rows)) for speed in speeds}


STUDY = Study(
    "price", QUESTION, CHOICE, cells, tables, words, draw, digest=partial(digest, axes=AXES)
)
