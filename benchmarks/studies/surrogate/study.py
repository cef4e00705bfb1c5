r"""Where the paper's surrogate of safety misorders plans.

The paper maximises the sum of margins; among plans of one game that is to minimise

    deficit at M' = sum over agents, their pairs in traffic, and times of (M' - min(M', s))

All plans for one game (a scenario, a speed set, a gain) are judged by it, at several caps M', and
by the union bound that the objective ``risk`` minimises, sum of g(s) over pairs and times.  The
judge is Pr(anybody crashes), simulated.

Plans come from every player, objective, M' and lam; straight model is one where it is free of
overlap.  How scores are held against the judge is told in :mod:`benchmarks.studies.orders`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks import sweeps
from benchmarks.studies.orders import ORDERS, Game, Pair, clearest, games
from benchmarks.studies.prices import PLAYERS, missing
from benchmarks.studies.results import Row, chance
from benchmarks.studies.study import OUT_OF_REACH, PAPER, Choice, Study, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GAINS = (0.0, 0.5)
PLANNED: tuple[dict[str, Any], ...] = (
    {"objective": "margin", "margin_cap": 3.0},
    {"objective": "margin", "margin_cap": 5.0},
    {"objective": "margin", "margin_cap": 8.0},
    {"objective": "risk"},
)
"""What plans are planned for."""

CAPS = (3.0, 5.0, 8.0)
"""M' of the deficits by which all plans are judged."""

SCORES = (*(f"deficit, M' = {cap:g}" for cap in CAPS), "union bound")


def cells(choice: Choice) -> list[sweeps.Cell]:
    """Every planner with every objective, M' and lam; and model straight ahead, once."""
    found = []
    for speed, scenario, gain in product(choice.speeds, choice.scenarios, GAINS):
        game = {"speed": speed, "gain": gain}
        asked = [
            (player, {**game, **planned, "lam": lam})
            for planned, lam, player in product(PLANNED, choice.lams, PLAYERS)
            if (scenario, planned.get("margin_cap")) not in OUT_OF_REACH
        ]
        asked.append(("straight", game))
        found += [
            sweeps.Cell(scenario, player, fields, episodes=choice.episodes, seed=choice.seed)
            for player, fields in asked
        ]
    return found


def digest(row: sweeps.Row) -> Row:
    """The plan's scores under every cap, the smallest margin of each time, and its crashes."""
    from ppg_env.formats.game_file import game_from_tables
    from ppg_env.game.evaluation import evaluate
    from ppg_env.game.plan import make_profile

    game = game_from_tables(row.game, row.scenario)
    profile = make_profile(game, row.controls or [])
    judged = [evaluate(replace(game, margin_cap=cap), profile) for cap in CAPS]
    widest = judged[-1]
    end = int(widest.traffic.any(axis=0).sum())
    plan = json.dumps((np.array([one.means for one in profile]).round(3) + 0.0).tolist())
    names = (
        "scenario", "speed", "gain", "player", "objective", "margin_cap", "lam", "arrival",
        "crash_probability", "crash_probability_low", "crash_probability_high",
    )  # fmt: skip
    return {name: getattr(row, name) for name in names} | {
        "plan": hashlib.sha256(plan.encode()).hexdigest()[:16],
        "scores": [*(float(one.deficit.sum()) for one in judged), widest.risk_bound_any],
        "margins": widest.margins.min(axis=0)[:end].round(3).tolist(),
    }


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


def tables(rows: Sequence[Row]) -> Iterator[Table]:
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


def _line(game: Game) -> tuple[str, ...]:
    told = [game.name, str(len(game.plans)), str(len(game.pairs))]
    for score in range(len(SCORES)):
        tau = game.tau(score)
        told += ["-" if np.isnan(tau) else f"{tau:.2f}", str(game.counts(score)["wrong"])]
    return tuple(told)


def _example(game: Game, score: int, pair: Pair) -> tuple[str, ...]:
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


def plan_name(row: Row) -> str:
    """Who made a plan, and for what."""
    if row["player"] == "straight":
        return "straight"
    cap = f", M' = {row['margin_cap']:g}" if row["objective"] == "margin" else ""
    return f"{row['player']} ({row['objective']}{cap}, lam {row['lam']:g})"


def words(rows: Sequence[Row]) -> Iterator[str]:
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


def draw(rows: Sequence[Row]) -> Mapping[str, Figure]:
    """One figure."""
    from benchmarks.studies.surrogate.figure import draw_scores

    return {"": draw_scores(games(rows))}


STUDY = Study(
    "surrogate",
    "Where does minus the sum of margins, the paper's surrogate, misorder plans against the "
    "probability of a crash?",
    Choice(PAPER, ("l1",), (0.5, 0.8, 0.9), episodes=100_000),
    cells,
    tables,
    words,
    draw,
    digest=digest,
)
