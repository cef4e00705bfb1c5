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
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from benchmarks import sweeps
from benchmarks.studies.prices import PLAYERS
from benchmarks.studies.results import StudyRow
from benchmarks.studies.study import OUT_OF_REACH, Choice

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


def digest(row: sweeps.Row) -> StudyRow:
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


def plan_name(row: StudyRow) -> str:
    """Who made a plan, and for what."""
    if row["player"] == "straight":
        return "straight"
    cap = f", M' = {row['margin_cap']:g}" if row["objective"] == "margin" else ""
    return f"{row['player']} ({row['objective']}{cap}, lam {row['lam']:g})"
