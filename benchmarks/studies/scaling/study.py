"""Scaling: what more agents and longer horizons do to planners, and to what they find.

Two families grow with N, ``circle(n)``, where all meet in one place, and ``streams(n)``, where two
rows cross; and one game, ``intersection``, has ever longer horizons.  ``nash`` is best-response
dynamics, ``social`` the optimum: proved up to five agents, searched for and bounded beyond.  Each
planner has half a minute.

    seconds, gap, regret     wall time of a planner; what is proved about its plans
    cost ratio, risk ratio   of ``nash`` over ``social``, as in :mod:`benchmarks.studies.prices`

Seconds, and what is found where they run out, depend on the machine: run the study alone and with
one job.  The rows say on what it was run.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING

from benchmarks import sweeps
from benchmarks.studies.prices import FOUND, OPTIMUM, Price, missing, prices
from benchmarks.studies.results import Row, chance, grouped
from benchmarks.studies.study import Choice, Study, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZES = (2, 3, 4, 6, 8, 10, 12, 16, 20)
HORIZONS = (12, 15, 20, 25, 30, 40)
LONG = "intersection"
"""The game whose horizon grows."""

LIMIT = 30.0
"""Seconds for each planner."""

PLAYERS = ("nash", OPTIMUM)
AXES = ("scenario", "family", "agents", "horizon", "speed", "lam")
"""Columns that tell games apart."""


def cells(choice: Choice) -> list[sweeps.Cell]:
    """Both planners in every game."""
    found = []
    for family, speed, lam in product(choice.scenarios, choice.speeds, choice.lams):
        fields = {"speed": speed, "objective": "risk", "lam": lam}
        games = (
            [(family, {**fields, "horizon": horizon}) for horizon in HORIZONS]
            if family == LONG
            else [(f"{family}({size})", fields) for size in SIZES]
        )
        found += [
            sweeps.Cell(
                scenario,
                player,
                game,
                episodes=choice.episodes,
                seed=choice.seed,
                time_limit=LIMIT,
            )
            for (scenario, game), player in product(games, PLAYERS)
        ]
    return found


def digest(row: sweeps.Row) -> Row:
    """The game, what was proved and found, and how long that took on which machine."""
    names = ("scenario", "agents", "horizon", "speed", "lam", "player", "gap", "seconds", *FOUND)
    return {name: getattr(row, name) for name in names} | {
        "family": row.scenario.partition("(")[0],
        "regret": row.regret and max(one or 0.0 for one in row.regret),
        "machine": f"{platform.machine()} with {os.cpu_count()} processors",
    }


def games(rows: Sequence[Row]) -> dict[str, list[tuple[Row, Row | None]]]:
    """By family, in growing games: the rows of ``nash`` and, where there is one, of ``social``."""
    known = grouped(
        [row for row in rows if "reason" not in row], lambda row: tuple(row[k] for k in AXES)
    )
    pairs = [{row["player"]: row for row in mine} for mine in known.values()]
    both = [(pair["nash"], pair.get(OPTIMUM)) for pair in pairs if "nash" in pair]
    return grouped(both, lambda pair: pair[0]["family"])


def size_of(row: Row) -> int:
    """What grows: the horizon of one family, the number of agents of the others."""
    return int(row["horizon"] if row["family"] == LONG else row["agents"])


HEADS = (
    "N", "horizon", "nash\ns", "regret\nat most", "social\ns", "gap", "cost\nratio", "crash\nnash",
    "crash\nsocial", "risk\nratio",
)  # fmt: skip


def tables(rows: Sequence[Row]) -> Iterator[Table]:
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


def _line(nash: Row, social: Row | None) -> tuple[str, ...]:
    own = (
        str(nash["agents"]),
        str(nash["horizon"]),
        f"{nash['seconds']:.2g}",
        f"{nash['regret']:.0e}" if "regret" in nash else nash["status"],
    )
    if social is None:
        return (*own, "-", "-", "-", chance(nash), "-", "-")
    price = Price(nash, social)
    told = f"{price.risk:.3g}"
    return (
        *own,
        f"{social['seconds']:.2g}",
        f"{social['gap']:.1%}",
        f"{price.cost:.3f}",
        chance(nash),
        chance(social),
        told if price.riskier or price.safer else f"({told})",
    )


def words(rows: Sequence[Row]) -> Iterator[str]:
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


def draw(rows: Sequence[Row]) -> Mapping[str, Figure]:
    """Seconds, gap, cost ratio and risk ratio over what grows."""
    from benchmarks.studies.scaling.figure import draw_growth

    return {"": draw_growth(games(rows))}


STUDY = Study(
    "scaling",
    "How do planners, and the price of selfishness, grow with the agents and with the horizon?",
    Choice(("circle", "streams", LONG), ("box",), (0.8,), episodes=20_000),
    cells,
    tables,
    words,
    draw,
    digest=digest,
)
