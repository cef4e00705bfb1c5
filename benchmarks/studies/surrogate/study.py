"""Tables, sentences and figures of the study ``surrogate``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.studies.orders import ORDERS, GamePlans, PlanPair, clearest, games
from benchmarks.studies.prices import missing
from benchmarks.studies.results import StudyRow, chance, crash_event
from benchmarks.studies.study import PAPER, Study, StudyChoice, Table
from benchmarks.studies.surrogate.data import CAPS, SCORES, cells, digest, plan_name
from benchmarks.studies.surrogate.figure import draw_scores

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = (
    "Where does minus the sum of margins, the paper's surrogate, misorder plans against the "
    "probability of a crash?"
)
CHOICE = StudyChoice(PAPER, ("l1",), (0.5, 0.8, 0.9), episodes=100_000)

SHORT = (*(f"M' = {cap:g}" for cap in CAPS), "bound")
COLUMNS = (
    "game",
    "plans",
    "pairs",
    *(f"{what}\n{name}" for name in SHORT for what in ("tau", "wrong")),
)
NOTE = (
    "By the deficit at each M', and by the union bound. Tau: Kendall's tau-b with the crash "
    "probability, of any {event}. Pairs: pairs of plans whose crash probabilities differ "
    "significantly. Wrong: pairs of which the score prefers the riskier plan."
)
EXAMPLE = (
    "game", "score", "it prefers", "to", "score\nfirst", "score\nsecond", "crash\nfirst",
    "crash\nsecond",
)  # fmt: skip


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield a table of the orders by each score, and one of the clearest errors."""
    compared, event = games(rows), crash_event(rows)
    lines = [_line(game) for game in compared]
    yield Table("How each score orders plans", COLUMNS, lines, NOTE.format(event=event))
    yield Table(
        "The clearest example of each game and score",
        EXAMPLE,
        [
            _example(game, score, best[1])
            for game in compared
            for score in range(len(SCORES))
            if (best := clearest([game], score)) is not None
        ],
        f"Plans are named by their player, objective, cap and lam. Crash: any {event}.",
        texts=4,
    )


def _line(game: GamePlans) -> tuple[str, ...]:
    entries = [game.name, str(len(game.plans)), str(len(game.pairs))]
    for score in range(len(SCORES)):
        tau = game.tau(score)
        entries += ["-" if np.isnan(tau) else f"{tau:.2f}", str(game.counts(score)["wrong"])]
    return tuple(entries)


def _example(game: GamePlans, score: int, pair: PlanPair) -> tuple[str, ...]:
    riskier, safer = pair.riskier, pair.safer
    return (
        game.name,
        SCORES[score],
        plan_name(riskier),
        plan_name(safer),
        f"{riskier['scores'][score]:.3g}",
        f"{safer['scores'][score]:.3g}",
        chance(riskier),
        chance(safer),
    )


def words(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield sentences on the rows."""
    compared = games(rows)
    pairs = sum(len(game.pairs) for game in compared)
    plans = sum(len(game.plans) for game in compared)
    yield (
        f"{plans} distinct plans in {len(compared)} games; {pairs} pairs of plans for one game "
        "differ significantly in risk."
    )
    for k, score in enumerate(SCORES):
        counts = {order: sum(game.counts(k)[order] for game in compared) for order in ORDERS}
        taus = [tau for game in compared if not np.isnan(tau := game.tau(k))]
        if not pairs or not taus:
            continue
        yield (
            f"{score}: of these pairs {counts['right']} right, {counts['tied']} tied, "
            f"{counts['wrong']} wrong ({counts['wrong'] / pairs:.1%}); tau {min(taus):.2f} to "
            f"{max(taus):.2f}, median {np.median(taus):.2f} of {len(taus)} games."
        )
    for k, score in enumerate(SCORES):
        best = clearest(compared, k)
        if best is not None:
            game, pair = best
            good, bad = (plan["scores"][k] for plan in (pair.safer, pair.riskier))
            yield (
                f"{score}, clearest example: in {game.name} it prefers {plan_name(pair.riskier)} "
                f"({bad:.3g}, crash probability {chance(pair.riskier)}) to "
                f"{plan_name(pair.safer)} ({good:.3g}, crash probability {chance(pair.safer)}), "
                f"which is at least {pair.least:.3g} times less likely to crash."
            )
    yield from missing(rows)


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw scores against crash probabilities."""
    return {"": draw_scores(games(rows), crash_event(rows))}


STUDY = Study("surrogate", QUESTION, CHOICE, cells, tables, words, draw, digest=digest)
