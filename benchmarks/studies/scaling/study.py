"""Tables, sentences and figures of the study ``scaling``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from benchmarks.studies.prices import Price, missing, prices
from benchmarks.studies.results import StudyRow, chance
from benchmarks.studies.scaling.data import (
    AXES,
    LIMIT,
    LONG,
    PLAYERS,
    cells,
    digest,
    games,
    size_of,
)
from benchmarks.studies.scaling.figure import draw_growth
from benchmarks.studies.study import Choice, Study, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = (
    "How do planners, and the price of selfishness, grow with the agents and with the horizon?"
)
CHOICE = Choice(("circle", "streams", LONG), ("box",), (0.8,), episodes=20_000)

HEADS = (
    "N", "horizon", "nash\ns", "regret\nat most", "social\ns", "gap", "cost\nratio", "crash\nnash",
    "crash\nsocial", "risk\nratio",
)  # fmt: skip


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """A table for every family."""
    for family, pairs in games(rows).items():
        machines = dict.fromkeys(nash["machine"] for nash, _ in pairs)
        yield Table(
            f"{family}, growing in {'its horizon' if family == LONG else 'agents'}",
            HEADS,
            [_line(nash, social) for nash, social in pairs],
            f"Seconds on {'; '.join(machines)}. Risk ratio in brackets: not beyond doubt.",
            texts=0,
        )


def _line(nash: StudyRow, social: StudyRow | None) -> tuple[str, ...]:
    own = (
        str(nash["agents"]),
        str(nash["horizon"]),
        f"{nash['seconds']:.2g}",
        f"{nash['regret']:.0e}" if "regret" in nash else nash["status"],
    )
    if social is None:
        return (*own, "-", "-", "-", chance(nash), "-", "-")
    price = Price(nash, social)
    return (
        *own,
        f"{social['seconds']:.2g}",
        f"{social['gap']:.1%}",
        f"{price.cost:.3f}",
        chance(nash),
        chance(social),
        price.risk_text,
    )


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """What the rows say, in sentences that the data write."""
    for family, pairs in games(rows).items():
        unit = "a horizon of" if family == LONG else "N ="
        for k, name in enumerate(PLAYERS):
            mine = [pair[k] for pair in pairs]
            done = [row for row in mine if row is not None and row["seconds"] < LIMIT]
            if done:
                last = max(done, key=size_of)
                yield (
                    f"{family}: {name} was done within {LIMIT:g} s up to {unit} {size_of(last)}, "
                    f"where it took {last['seconds']:.2g} s."
                )
        settled = [nash for nash, _ in pairs if nash["status"] == "equilibrium"]
        yield (
            f"{family}: {len(settled)} of {len(pairs)} runs of the dynamics ended at a certified "
            f"equilibrium."
        )
        proved = [size_of(s) for _, s in pairs if s is not None and s["status"] == "optimal"]
        if proved:
            yield f"{family}: the optimum is proved up to {unit} {max(proved)}."
    found = prices(rows, "nash", AXES)
    riskier = [one for one in found if one.riskier]
    if found:
        yield (
            f"Equilibria are riskier than the optimum, or the plans found for it, beyond doubt in "
            f"{len(riskier)} of {len(found)} games, safer in {sum(p.safer for p in found)}; cost "
            f"ratios are {min(p.cost for p in found):.3f} to {max(p.cost for p in found):.3f} "
            f"(below one, the search for the optimum stopped too early)."
        )
    yield from missing(rows)


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw seconds, gap, cost ratio and risk ratio over the size of the games."""
    return {"": draw_growth(games(rows))}


STUDY = Study("scaling", QUESTION, CHOICE, cells, tables, words, draw, digest=digest)
