"""Results as plain dictionaries with the public names, for ``--json`` and plan files."""

from __future__ import annotations

from typing import Any

import numpy as np

from ppg_env.game.evaluation import Evaluation
from ppg_env.game.game import Game
from solvers.solution import Solution


def game_name(game: Game) -> str:
    """The scenario's name, or a word for a game without one."""
    return game.name or "unnamed game"


def solution_report(solution: Solution) -> dict[str, Any]:
    """What ``ppg solve --json`` prints."""
    found = solution.evaluation
    head = {
        "scenario": game_name(solution.game),
        "solution": solution.name,
        "objective": solution.game.objective,
        "status": str(solution.status),
        "advice": solution.advice,
    }
    tail = {
        "minimised": solution.minimised,
        "value": solution.value,
        "bound": solution.bound,
        "gap": solution.gap,
        "regret": solution.regret,
        "seconds": solution.seconds,
    }
    if found is None or solution.profile is None:
        return head | tail
    return {
        **head,
        **evaluation_report(found),
        **tail,
        "updates": len(solution.trace),
        "means": np.array(
            [plan.means.tolist() for plan in solution.profile], dtype=object
        ).tolist(),
        "controls": [plan.controls.tolist() for plan in solution.profile],
    }


def evaluation_report(found: Evaluation) -> dict[str, Any]:
    """Costs and safety of a profile, by the evaluator."""
    exact = found.game.scale == "exact"
    return {
        "arrival": list(found.arrival),
        "cost": found.cost,
        "shifted_cost": found.shifted_cost,
        "social_cost": found.social_cost,
        "potential": found.potential,
        "safety_cost": found.safety_cost,
        "deficit": found.deficit,
        "risk_bound": found.risk_bound if exact else None,
        "risk_bound_any": found.risk_bound_any if exact else None,
        "complaints": list(found.violations()),
    }
