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
    NOTE,
    SUMMARY,
    Price,
    digest,
    missing,
    prices,
    riskiest,
    sides,
    summary,
    verdict,
)
from benchmarks.studies.results import NEGLIGIBLE, StudyRow, chance, grouped
from benchmarks.studies.study import PAPER, Choice, Study, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = "Equilibria cost little more than the optimum: how much more do they risk?"
CHOICE = Choice(PAPER, ("l1", "disc"), (0.1, 0.3, 0.5, 0.7, 0.8, 0.9), episodes=100_000)

FAMILIES = ("scenario", "objective", "gain", *SUMMARY)
DOUBTLESS = (
    "scenario", "speed", "objective", "equilibrium", "gain", "lam", "cost\nratio", "crash\nequil.",
    "crash\noptimum", "risk\nratio", "at least", "bound\nratio",
)  # fmt: skip


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Families of games for each speed set; then all games in which the risks differ."""
    found = {name: prices(rows, name, AXES) for name in EQUILIBRIA}
    families = {name: grouped(some, family) for name, some in found.items()}
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
        yield Table(title, FAMILIES, lines, NOTE, texts=2)
    lines = [
        _line(name, one) for name in EQUILIBRIA for one in found[name] if one.riskier or one.safer
    ]
    yield Table(
        "All games in which the risks differ beyond doubt",
        DOUBTLESS,
        lines,
        "Crash: Pr(anybody crashes); in risk ratios those below "
        f"{NEGLIGIBLE:g} count as it. At least: lower limit of the risk ratio. Bound ratio: of the "
        "union bounds.",
        texts=4,
    )


def _line(name: str, one: Price) -> tuple[str, ...]:
    game = one.selfish
    return (
        game["scenario"],
        game["speed"],
        game["objective"],
        name,
        f"{game['gain']:g}",
        f"{game['lam']:g}",
        f"{one.cost:.3f}",
        chance(one.selfish),
        chance(one.social),
        f"{one.risk:.3g}",
        f"{one.least:.3g}",
        "-" if one.bound is None else f"{one.bound:.3g}",
    )


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """What the rows say, in sentences that the data write."""
    for name in EQUILIBRIA:
        found = prices(rows, name, AXES)
        if not found:
            continue
        yield verdict(found, name)
        worst, dearest = riskiest(found), max(found, key=lambda one: one.cost)
        if worst.riskier:
            yield (
                f"{name}, riskiest: risk ratio {worst.risk:.3g} (at least {worst.least:.3g}) at "
                f"a cost ratio of {worst.cost:.3f}, in {_named(worst)}."
            )
        yield f"{name}, dearest: cost ratio {dearest.cost:.3f}, in {_named(dearest)}."
        yield f"{name}, riskier / safer: {'; '.join(_by_axis(found))}."
        told = [one for one in found if (one.riskier or one.safer) and one.bound is not None]
        right = sum((one.bound > 1) == one.riskier for one in told if one.bound is not None)
        if told:
            yield (
                f"{name}: where the risks differ beyond doubt, the union bounds have the same "
                f"order in {right} of {len(told)} games."
            )
    yield from missing(rows)


def _named(price: Price) -> str:
    game = price.selfish
    return (
        f"{game['scenario']} ({game['speed']}, {game['objective']}, gain {game['gain']:g}, "
        f"lam {game['lam']:g})"
    )


def _by_axis(found: Sequence[Price]) -> Iterator[str]:
    """Riskier and safer games of how many, for every value of every axis."""
    for axis in AXES:
        values = dict.fromkeys(one.selfish[axis] for one in found)
        some = {value: [one for one in found if one.selfish[axis] == value] for value in values}
        counts = (f"{value} {sides(mine)} of {len(mine)}" for value, mine in some.items())
        yield f"by {axis} {', '.join(counts)}"


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """A figure for each speed set."""
    found = {name: grouped(prices(rows, name, AXES), family) for name in EQUILIBRIA}
    speeds = dict.fromkeys(key[0] for key in found["nash"])
    return {speed: draw_speed(found, speed) for speed in speeds}


STUDY = Study(
    "price", QUESTION, CHOICE, cells, tables, words, draw, digest=partial(digest, axes=AXES)
)
