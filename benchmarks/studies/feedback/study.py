"""Tables of the study ``feedback``, and the study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from benchmarks.studies.feedback.data import (
    KINDS,
    PLAYERS,
    SELFISH,
    Games,
    by_game,
    cells,
    digest,
    largest_regret,
    price,
)
from benchmarks.studies.feedback.figure import draw_all
from benchmarks.studies.feedback.findings import findings
from benchmarks.studies.results import StudyRow, chance, grouped
from benchmarks.studies.study import PAPER, Choice, Study, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = (
    "Which of the paper's findings hold among players that observe all agents: feedback optimum, "
    "feedback equilibrium, and learned players?"
)
TWO = tuple(name for name in PAPER if name != "intersection3")
"""The scenarios of the paper with two agents."""

CHOICE = Choice(TWO, ("l1",), (0.8,), episodes=50_000)

SHORT = ("plan\nnash", "plan\nsocial", "re-plan\nnash", "re-plan\nsocial", "feedb.\nnash",
         "feedb.\nsocial", "ppo\nselfish", "ppo\nsocial")  # fmt: skip
"""Names of the players in the heads of tables."""

GAME = ("scenario", "lam")


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield the tables of each speed set: costs, crash probabilities, prices and regrets."""
    for speed, games in _by_speed(rows).items():
        place = f"speed set {speed}"
        yield Table(f"Expected cost, {place}", (*GAME, *SHORT), _lines(games, _cost), COST)
        yield Table(
            f"Pr(any agent crashes), {place}", (*GAME, *SHORT), _lines(games, chance), CRASH
        )
        columns = (*GAME, *(f"{what}\n{kind}" for what in ("cost", "risk") for kind in KINDS))
        yield Table(f"Selfish over social, {place}", columns, _prices(games), PRICE)
        names = tuple(SHORT[PLAYERS.index(name)] for name in SELFISH)
        yield Table(f"Regret over cost, {place}", (*GAME, *names), _regrets(games), REGRET)


COST = "Lam per step and (1 - lam) 100 for a crash, mean over agents."
CRASH = "An overlap of two agents in traffic at a time step, in the environment."
PRICE = "Cost: ratio of expected costs. Risk: ratio of crash probabilities."
REGRET = "The largest gain of an agent by the best response of dynamic programming."


def _by_speed(rows: Sequence[StudyRow]) -> Mapping[str, Games]:
    games = by_game(rows)
    keys = grouped(games, lambda key: key[0])
    return {speed: {key: games[key] for key in own} for speed, own in keys.items()}


def _head(key: tuple[str, str, float]) -> tuple[str, str]:
    return key[1], f"{key[2]:g}"


def _lines(games: Games, shown: object) -> list[tuple[str, ...]]:
    assert callable(shown)
    return [
        (*_head(key), *(shown(rows[name]) if name in rows else "" for name in PLAYERS))
        for key, rows in games.items()
    ]


def _cost(row: StudyRow) -> str:
    return f"{row['expected_cost']:.2f}"


def _prices(games: Games) -> list[tuple[str, ...]]:
    return [
        (
            *_head(key),
            *(
                f"{price(rows[one], rows[other], what).value:{form}}"
                if one in rows and other in rows
                else ""
                for what, form in (("cost", ".3f"), ("risk", ".3g"))
                for one, other in KINDS.values()
            ),
        )
        for key, rows in games.items()
    ]


def _regrets(games: Games) -> list[tuple[str, ...]]:
    lines = []
    for key, rows in games.items():
        shares = [largest_regret(rows[name]) if name in rows else None for name in SELFISH]
        if any(share is not None for share in shares):
            lines.append((*_head(key), *("" if s is None else f"{s:.2%}" for s in shares)))
    return lines


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield sentences on the rows."""
    yield from findings(rows)


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw the figures of cost, crash probability and regret."""
    return draw_all(by_game(rows))


STUDY = Study("feedback", QUESTION, CHOICE, cells, tables, words, draw, digest=digest)
