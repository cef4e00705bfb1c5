"""Solutions and evaluations as plain dictionaries, for ``--json`` and plan files."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.comparison.overlaps import between_steps_report
from ppg_env.game.evaluation import Evaluation
from ppg_env.game.game import Game
from solvers.solution import Solution


def game_name(game: Game) -> str:
    """Return the scenario's name, or a substitute for a game without one."""
    return game.name or "unnamed game"


def solution_report(solution: Solution) -> dict[str, Any]:
    """Return what ``ppg solve --json`` prints."""
    evaluation = solution.evaluation
    head = {
        "scenario": game_name(solution.game),
        "solution": solution.name,
        "objective": solution.game.objective,
        "collisions": solution.game.collisions,
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
    if evaluation is None or solution.profile is None:
        return head | tail
    return {
        **head,
        **evaluation_report(evaluation),
        "between_steps": between_steps_report(solution.game, solution.profile),
        **tail,
        "updates": len(solution.trace),
        "means": np.array(
            [plan.means.tolist() for plan in solution.profile], dtype=object
        ).tolist(),
        "controls": [plan.controls.tolist() for plan in solution.profile],
    }


def evaluation_report(evaluation: Evaluation) -> dict[str, Any]:
    """Return costs and safety of a profile, by the evaluator."""
    exact = evaluation.game.scale == "exact"
    return {
        "arrival": list(evaluation.arrival),
        "cost": evaluation.cost,
        "shifted_cost": evaluation.shifted_cost,
        "social_cost": evaluation.social_cost,
        "potential": evaluation.potential,
        "safety_cost": evaluation.safety_cost,
        "deficit": evaluation.deficit,
        "risk_bound": evaluation.risk_bound if exact else None,
        "risk_bound_any": evaluation.risk_bound_any if exact else None,
        "complaints": list(evaluation.violations()),
    }
