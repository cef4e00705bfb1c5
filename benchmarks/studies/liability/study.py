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
from benchmarks.studies.results import StudyRow, crash_event, grouped
from benchmarks.studies.study import PAPER, Study, StudyChoice, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = "Which rule of liability restores the social optimum, and among how many agents?"
CHOICE = StudyChoice(
    (*PAPER, "circle(4)", "circle(6)", "streams(6)"),
    ("l1",),
    (0.8,),
    episodes=100_000,
)

HEADS = ("scenario", "N", *(rule.replace(":", "\n") for rule in RULES))


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield tables of cost gaps and risk ratios of every game."""
    for (speed, kind, lam), compared in games(rows).items():
        where = f"agents {kind}, {'mean ' * (kind == 'unlike')}lam {lam:g}, speed set {speed}"
        yield Table(
            f"Cost gap, {where}",
            HEADS,
            [(*_named(game), *(_gap(game, rule) for rule in RULES)) for game in compared],
            "In per cent; for both orders, if they differ. Star: the least cost is not proved.",
        )
        yield Table(
            f"Risk ratio, {where}",
            HEADS,
            [(*_named(game), *(_risk(game, rule) for rule in RULES)) for game in compared],
            f"Risk: Pr(any {crash_event(rows)}), of the riskier order. In brackets: not "
            "significant.",
        )


def _named(game: GameUnderRules) -> tuple[str, str]:
    return game.scenario + "*" * (not game.proved), str(game.agents)


def _gap(game: GameUnderRules, rule: str) -> str:
    shown = [f"{100 * gap:.2f}" if gap < inf else "no end" for gap in game.gaps(rule)]
    return " to ".join(dict.fromkeys(shown))


def _risk(game: GameUnderRules, rule: str) -> str:
    price = worst(game, rule)
    return "-" if price is None else price.risk_text


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield sentences on the rows."""
    compared = [game for some in games(rows).values() for game in some]
    for size, own in sorted(grouped(compared, lambda game: game.agents).items()):
        counts = ", ".join(
            f"{rule} {sum(g.restored(rule) for g in own)} ({sum(g.can(rule) for g in own)})"
            for rule in RULES
        )
        yield (
            f"{size} agents: of {len(own)} games each rule restores the optimum (can restore it) "
            f"in: {counts}."
        )
    for rule in RULES:
        settled = [game for game in compared if game.gaps(rule)[1] < inf]
        if not settled:
            continue
        riskiest = [price for game in settled if (price := worst(game, rule))]
        low, high = np.mean([game.gaps(rule) for game in settled], axis=0)
        costliest = max((game.gaps(rule)[1], game.scenario) for game in settled)
        yield (
            f"{rule}: cost gap {low:.2%} on average in the better order, {high:.2%} in the worse, "
            f"at most {costliest[0]:.2%} ({costliest[1]}); in its riskier order significantly "
            f"riskier than the cheapest plans in {sum(price.riskier for price in riskiest)} of "
            f"{len(riskiest)} games, safer in {sum(price.safer for price in riskiest)}."
        )
    yield from _shares(compared)
    unsettled = sum(game.gaps(rule)[1] == inf for game in compared for rule in RULES)
    yield f"Pairs of rule and game without convergence to an equilibrium: {unsettled}."
    yield from missing(rows)


def _shares(compared: Sequence[GameUnderRules]) -> Iterator[str]:
    """Yield a sentence on the least share that suffices where the whole harm does."""
    cured = [g for g in compared if g.can("pigou") and not g.can("selfish")]
    if not cured:
        return
    least = [next(rule for rule in SHARES if game.can(rule)) for game in cured]
    counts = ", ".join(f"{rule} in {least.count(rule)}" for rule in SHARES if rule in least)
    yield (
        f"Games whose optimum selfish agents miss in both orders and pigou can restore: "
        f"{len(cured)}; the smallest share that can restore it is {counts}."
    )


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw cost gaps above and risk ratios below, with a column for each society."""
    by_speed, event = grouped(games(rows).items(), lambda item: item[0][0]), crash_event(rows)
    return {
        speed if len(by_speed) > 1 else "": draw_games(some, event)
        for speed, some in by_speed.items()
    }


STUDY = Study("liability", QUESTION, CHOICE, cells, tables, words, draw, digest=digest)
