"""Tables, sentences and figures of the study ``liability``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.studies.liability.data import (
    RULES,
    SHARES,
    GameUnderRules,
    cells,
    digest,
    games,
    worst,
)
from benchmarks.studies.liability.figure import draw_games
from benchmarks.studies.prices import missing
from benchmarks.studies.results import StudyRow, grouped
from benchmarks.studies.study import PAPER, Choice, Study, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = "Which rule of liability restores the social optimum, and among how many agents?"
CHOICE = Choice(
    (*PAPER, "circle(4)", "circle(6)", "streams(6)"),
    ("l1",),
    (0.8,),
    episodes=100_000,
)

HEADS = ("scenario", "N", *(rule.replace(":", "\n") for rule in RULES))


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Cost gaps and risk ratios of every game."""
    for (speed, kind, lam), found in games(rows).items():
        where = f"agents {kind}, {'mean ' * (kind == 'unlike')}lam {lam:g}, speed set {speed}"
        yield Table(
            f"Cost gap, {where}",
            HEADS,
            [(*_named(game), *(_gap(game, rule) for rule in RULES)) for game in found],
            "In per cent; of the two orders, if they differ. Star: the least cost is not proved.",
        )
        yield Table(
            f"Risk ratio, {where}",
            HEADS,
            [(*_named(game), *(_risk(game, rule) for rule in RULES)) for game in found],
            "The order that is riskier. In brackets: not beyond doubt.",
        )


def _named(game: GameUnderRules) -> tuple[str, str]:
    return game.scenario + "*" * (not game.proved), str(game.agents)


def _gap(game: GameUnderRules, rule: str) -> str:
    shown = [f"{100 * gap:.2f}" if gap < inf else "no end" for gap in game.gaps(rule)]
    return " to ".join(dict.fromkeys(shown))


def _risk(game: GameUnderRules, rule: str) -> str:
    one = worst(game, rule)
    return "-" if one is None else one.risk_text


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """What the rows say, in sentences that the data write."""
    found = [game for some in games(rows).values() for game in some]
    for size, mine in sorted(grouped(found, lambda game: game.agents).items()):
        counts = ", ".join(
            f"{rule} {sum(g.restored(rule) for g in mine)} ({sum(g.can(rule) for g in mine)})"
            for rule in RULES
        )
        yield (
            f"{size} agents: of {len(mine)} games each rule restores the optimum (can restore it) "
            f"in: {counts}."
        )
    for rule in RULES:
        settled = [game for game in found if game.gaps(rule)[1] < inf]
        if not settled:
            continue
        told = [one for game in settled if (one := worst(game, rule))]
        low, high = np.mean([game.gaps(rule) for game in settled], axis=0)
        dearest = max((game.gaps(rule)[1], game.scenario) for game in settled)
        yield (
            f"{rule}: cost gap {low:.2%} on average in the better order, {high:.2%} in the worse, "
            f"at most {dearest[0]:.2%} ({dearest[1]}); in its riskier order riskier than the "
            f"cheapest plans beyond doubt in {sum(one.riskier for one in told)} of {len(told)} "
            f"games, safer in {sum(one.safer for one in told)}."
        )
    yield from _shares(found)
    unsettled = sum(game.gaps(rule)[1] == inf for game in found for rule in RULES)
    yield f"Rules and games in which the dynamics did not end at an equilibrium: {unsettled}."
    yield from missing(rows)


def _shares(found: Sequence[GameUnderRules]) -> Iterator[str]:
    """How large a share is enough where paying for all the harm is."""
    cured = [g for g in found if g.can("pigou") and not g.can("selfish")]
    if not cured:
        return
    least = [next(rule for rule in SHARES if game.can(rule)) for game in cured]
    counts = ", ".join(f"{rule} in {least.count(rule)}" for rule in SHARES if rule in least)
    yield (
        f"The optimum that selfish agents miss in both orders and pigou can restore: {len(cured)} "
        f"games; the smallest share that can restore it is {counts}."
    )


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Cost gaps above, risk ratios below; a column for each society."""
    by_speed = grouped(games(rows).items(), lambda item: item[0][0])
    return {
        speed if len(by_speed) > 1 else "": draw_games(some) for speed, some in by_speed.items()
    }


STUDY = Study("liability", QUESTION, CHOICE, cells, tables, words, draw, digest=digest)
