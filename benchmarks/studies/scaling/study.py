"""Tables, sentences and figures of the study ``scaling``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from benchmarks.studies.prices import Price, missing, prices
from benchmarks.studies.results import StudyRow, chance, crash_event
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
from benchmarks.studies.study import Study, StudyChoice, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = "How do planners, and the price of selfishness, grow with agents and horizon?"
CHOICE = StudyChoice(("circle", "streams", LONG), ("box",), (0.8,), episodes=20_000)

HEADS = (
    "N", "horizon", "nash\ns", "regret\nat most", "social\ns", "gap", "cost\nratio", "crash\nnash",
    "crash\nsocial", "risk\nratio",
)  # fmt: skip


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield a table for every family."""
    for family, pairs in games(rows).items():
        machines = dict.fromkeys(nash["machine"] for nash, _ in pairs)
        yield Table(
            f"{family}, growing in {'its horizon' if family == LONG else 'agents'}",
            HEADS,
            [_line(nash, social) for nash, social in pairs],
            f"Seconds on {'; '.join(machines)}. Crash, risk: any {crash_event(rows)}; risk ratio "
            "in brackets: not significant.",
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
    """Yield sentences on the rows."""
    for family, pairs in games(rows).items():
        unit = "a horizon of" if family == LONG else "N ="
        for k, name in enumerate(PLAYERS):
            own = [pair[k] for pair in pairs]
            done = [row for row in own if row is not None and row["seconds"] < LIMIT]
            if done:
                last = max(done, key=size_of)
                yield (
                    f"{family}: {name} finished within {LIMIT:g} s up to {unit} {size_of(last)}, "
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
    compared = prices(rows, "nash", AXES)
    riskier = sum(price.riskier for price in compared)
    if compared:
        yield (
            f"Equilibria are significantly riskier than the optimum, or the best known plans, in "
            f"{riskier} of {len(compared)} games, safer in {sum(p.safer for p in compared)}; "
            f"cost ratios are {min(p.cost for p in compared):.3f} to "
            f"{max(p.cost for p in compared):.3f} (below one, the search for the optimum stopped "
            f"too early)."
        )
    yield from missing(rows)


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw seconds, gap, cost ratio and risk ratio over the size of the games."""
    return {"": draw_growth(games(rows), crash_event(rows))}


STUDY = Study("scaling", QUESTION, CHOICE, cells, tables, words, draw, digest=digest)
