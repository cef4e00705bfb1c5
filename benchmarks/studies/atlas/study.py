"""Tables, sentences and figures of the study ``atlas``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from benchmarks.studies.atlas.data import (
    SAME,
    EquilibriumKind,
    GameEquilibria,
    cells,
    digest,
    games,
)
from benchmarks.studies.atlas.figure import draw_atlas
from benchmarks.studies.prices import missing
from benchmarks.studies.results import StudyRow, chance, crash_event, limits
from benchmarks.studies.study import PAPER, Study, StudyChoice, Table
from solvers.equilibrium.start_profile import STARTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = "Which equilibria does a game have, and in which of them do best responses end?"
CHOICE = StudyChoice((*PAPER, "circle(4)"), ("l1",), (0.8,), episodes=20_000)

HEADS = (
    "who passes whom", "equilibria", "share\nof runs", *(f"from\n{start}" for start in STARTS),
    "social cost", "crash\nprobability", "regret\nat most",
)  # fmt: skip


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield a table of the kinds of equilibrium of every game."""
    note = (
        "Equilibria: number of distinct costs of a kind; ranges are over these. Crash: any "
        f"{crash_event(rows)}."
    )
    for game in games(rows):
        yield Table(
            f"{game.name}: {len(game.runs)} runs",
            HEADS,
            [_line(game, kind) for kind in game.kinds],
            note,
        )


def _line(game: GameEquilibria, kind: EquilibriumKind) -> tuple[str, ...]:
    distinct = kind.distinct
    risks = sorted(distinct, key=lambda row: row["crash_probability"])
    return (
        kind.name,
        str(len(distinct)),
        f"{kind.share(game.runs):.0%}",
        *(f"{kind.share(game.runs, start):.0%}" for start in STARTS),
        _range(f"{row['social_cost']:.3f}" for row in (distinct[0], distinct[-1])),
        _range(chance(row) for row in (risks[0], risks[-1])),
        f"{max(row['regret'] for row in kind.rows):.0e}",
    )


def _range(ends: Iterator[str]) -> str:
    return " to ".join(dict.fromkeys(ends))


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield sentences on the rows."""
    compared = games(rows)
    for game in compared:
        equilibria, kinds = game.equilibria, game.kinds
        if not equilibria:
            yield f"{game.name}: no run ended at an equilibrium."
            continue
        largest = max(kinds, key=lambda kind: kind.share(game.runs))
        costliest, cheapest = equilibria[-1]["social_cost"], equilibria[0]["social_cost"]
        best = sum(row["social_cost"] <= cheapest * (1 + SAME) for row in game.ended)
        yield (
            f"{game.name}: {len(equilibria)} equilibria of {len(kinds)} kinds, distinct in cost or "
            f"kind; the costliest is {costliest / cheapest - 1:.2%} above the cheapest; "
            f"{_risks(equilibria)}. The most frequent kind is {largest.name}, from "
            f"{largest.share(game.runs):.0%} of the runs; {best / len(game.runs):.0%} end at the "
            f"least cost."
        )
    lost = sum(row["status"] != "equilibrium" for game in compared for row in game.runs)
    yield f"Runs that did not end at a certified equilibrium: {lost} of {len(rows)}."
    yield from missing(rows)


def _risks(equilibria: Sequence[StudyRow]) -> str:
    safest = min(equilibria, key=lambda row: row["crash_probability_high"])
    riskiest = max(equilibria, key=lambda row: row["crash_probability_low"])
    least = limits(riskiest)[0] / limits(safest)[1]
    if len(equilibria) == 1:
        return f"its crash probability is {chance(riskiest)}"
    if least <= 1:
        return f"their crash probabilities do not differ significantly ({chance(riskiest)})"
    return (
        f"crash probabilities from {chance(safest)} to {chance(riskiest)}, "
        f"at least {least:.2g} times as likely"
    )


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw a panel for each game."""
    return {"": draw_atlas(games(rows), crash_event(rows))}


STUDY = Study("atlas", QUESTION, CHOICE, cells, tables, words, draw, digest=digest)
