r"""Plans that the paper's surrogate of safety misorders.

The paper maximises the sum of margins; for plans of one game this is the same as to minimise

    deficit at M' = sum over agents, their pairs in traffic, and times of (M' - min(M', s))

All plans for one game (a scenario, a speed set, a gain) are scored by it, at several caps M', and
by the union bound that the objective ``risk`` minimises, the sum of g(s) over pairs and times.  The
scores are compared with simulated crash probabilities, see :mod:`benchmarks.studies.orders`.

Plans come from every player, objective, M' and lam, and from the straight model where it has no
overlap.
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
from benchmarks.studies.study import OUT_OF_REACH, StudyChoice

GAINS = (0.0, 0.5)
PLANNED: tuple[dict[str, Any], ...] = (
    {"objective": "margin", "margin_cap": 3.0},
    {"objective": "margin", "margin_cap": 5.0},
    {"objective": "margin", "margin_cap": 8.0},
    {"objective": "risk"},
)
"""The objectives of the planners."""

CAPS = (3.0, 5.0, 8.0)
"""Caps M' of the deficits that score all plans."""

SCORES = (*(f"deficit, M' = {cap:g}" for cap in CAPS), "union bound")


def cells(choice: StudyChoice) -> list[sweeps.Cell]:
    """Return the cells: every planner with every objective, M' and lam; the straight model once."""
    chosen = []
    for speed, scenario, gain in product(choice.speeds, choice.scenarios, GAINS):
        game = {"speed": speed, "gain": gain}
        asked = [
            (player, {**game, **planned, "lam": lam})
            for planned, lam, player in product(PLANNED, choice.lams, PLAYERS)
            if (scenario, planned.get("margin_cap")) not in OUT_OF_REACH
        ]
        asked.append(("straight", game))
        chosen += [
            sweeps.Cell(scenario, player, fields, episodes=choice.episodes, seed=choice.seed)
            for player, fields in asked
        ]
    return chosen


def digest(row: sweeps.Row) -> StudyRow:
    """Return the plan's scores, its smallest margin at each time, and its crash probability."""
    from ppg_env.formats.game_file import game_from_tables
    from ppg_env.game.evaluation import evaluate
    from ppg_env.game.plan import make_profile

    game = game_from_tables(row.game, row.scenario)
    profile = make_profile(game, row.controls or [])
    evaluations = [evaluate(replace(game, margin_cap=cap), profile) for cap in CAPS]
    widest = evaluations[-1]
    end = int(widest.traffic.any(axis=0).sum())
    plan = json.dumps((np.array([agent.means for agent in profile]).round(3) + 0.0).tolist())
    names = (
        "scenario", "speed", "gain", "player", "objective", "margin_cap", "lam", "arrival",
        "crash_probability", "crash_probability_low", "crash_probability_high",
    )  # fmt: skip
    return {name: getattr(row, name) for name in names} | {
        "plan": hashlib.sha256(plan.encode()).hexdigest()[:16],
        "scores": [*(float(scored.deficit.sum()) for scored in evaluations), widest.risk_bound_any],
        "margins": widest.margins.min(axis=0)[:end].round(3).tolist(),
    }


def plan_name(row: StudyRow) -> str:
    """Return the name of a plan: its player, objective, cap and lam."""
    if row["player"] == "straight":
        return "straight"
    cap = f", M' = {row['margin_cap']:g}" if row["objective"] == "margin" else ""
    return f"{row['player']} ({row['objective']}{cap}, lam {row['lam']:g})"
