"""Tables, sentences and figures of the study ``surrogate``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.studies.orders import ORDERS, GamePlans, PlanPair, clearest, games
from benchmarks.studies.prices import missing
from benchmarks.studies.results import StudyRow, chance
from benchmarks.studies.study import PAPER, Choice, Study, Table
from benchmarks.studies.surrogate.data import CAPS, SCORES, cells, digest, plan_name
from benchmarks.studies.surrogate.figure import draw_scores

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = (
    "Where does minus the sum of margins, the paper's surrogate, misorder plans against the "
    "probability of a crash?"
)
CHOICE = Choice(PAPER, ("l1",), (0.5, 0.8, 0.9), episodes=100_000)

SHORT = (*(f"M' = {cap:g}" for cap in CAPS), "bound")
COLUMNS = (
    "game",
    "plans",
    "told\napart",
    *(f"{what}\n{name}" for name in SHORT for what in ("tau", "wrong")),
)
NOTE = (
    "By the deficit at each M', and by the union bound. Tau: Kendall's tau-b with the crash "
    "probability. Told apart: pairs of plans whose crash probabilities differ beyond doubt. Wrong: "
    "such pairs of which the score prefers the riskier plan."
)
EXAMPLE = (
    "game", "score", "it prefers", "to", "score\nfirst", "score\nsecond", "crash\nfirst",
    "crash\nsecond",
)  # fmt: skip


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """How each score orders the plans for each game, and where it errs most clearly."""
    found = games(rows)
    yield Table("How each score orders plans", COLUMNS, [_line(game) for game in found], NOTE)
    yield Table(
        "The clearest example of each game and score",
        EXAMPLE,
        [
            _example(game, score, best[1])
            for game in found
            for score in range(len(SCORES))
            if (best := clearest([game], score)) is not None
        ],
        "Plans by who planned them, and for which objective, cap and lam.",
        texts=4,
    )


def _line(game: GamePlans) -> tuple[str, ...]:
    told = [game.name, str(len(game.plans)), str(len(game.pairs))]
    for score in range(len(SCORES)):
        tau = game.tau(score)
        told += ["-" if np.isnan(tau) else f"{tau:.2f}", str(game.counts(score)["wrong"])]
    return tuple(told)


def _example(game: GamePlans, score: int, pair: PlanPair) -> tuple[str, ...]:
    one, other = pair.riskier, pair.safer
    return (
        game.name,
        SCORES[score],
        plan_name(one),
        plan_name(other),
        f"{one['scores'][score]:.3g}",
        f"{other['scores'][score]:.3g}",
        chance(one),
        chance(other),
    )


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """What the rows say, in sentences that the data write."""
    found = games(rows)
    pairs = sum(len(game.pairs) for game in found)
    plans = sum(len(game.plans) for game in found)
    yield (
        f"{plans} plans that differ, in {len(found)} games; {pairs} pairs of plans for one game "
        "differ in risk beyond doubt."
    )
    for k, score in enumerate(SCORES):
        counts = {order: sum(game.counts(k)[order] for game in found) for order in ORDERS}
        taus = [tau for game in found if not np.isnan(tau := game.tau(k))]
        if not pairs or not taus:
            continue
        yield (
            f"{score}: of these pairs {counts['right']} right, {counts['tied']} tied, "
            f"{counts['wrong']} wrong ({counts['wrong'] / pairs:.1%}); tau {min(taus):.2f} to "
            f"{max(taus):.2f}, median {np.median(taus):.2f} of {len(taus)} games."
        )
    for k, score in enumerate(SCORES):
        best = clearest(found, k)
        if best is not None:
            game, pair = best
            good, bad = (one["scores"][k] for one in (pair.safer, pair.riskier))
            yield (
                f"{score}, clearest example: in {game.name} it prefers {plan_name(pair.riskier)} "
                f"({bad:.3g}, crash probability {chance(pair.riskier)}) to "
                f"{plan_name(pair.safer)} ({good:.3g}, crash probability {chance(pair.safer)}), "
                f"which crashes at least {pair.least:.3g} times less often."
            )
    yield from missing(rows)


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw scores against crash probabilities."""
    return {"": draw_scores(games(rows))}


STUDY = Study("surrogate", QUESTION, CHOICE, cells, tables, words, draw, digest=digest)
