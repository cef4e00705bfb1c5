"""Results of a comparison: what each player planned, and how it played."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.comparison.overlaps import between_steps_report
from benchmarks.comparison.players import Entrant
from benchmarks.comparison.report import evaluation_report, game_name
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from ppg_env.support.statistics import Estimate, Interval, RareEstimate
from solvers.feedback.grid.feedback_solution import FeedbackSolution
from solvers.solution import Solution

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Played:
    """Simulation of a player.

    Attributes
    ----------
    information : observed information: open loop, own state or full state.
    arrival : per agent its arrival time, or in ``env`` the mean over episodes that arrive.
    success : per agent the share of episodes that arrive; None on schedule.
    crash, crash_any : crash probability per agent, and of any agent.
    method : ``mc``, or ``rare`` if fewer than ``FEW`` crashes were counted.
    expected_cost : mean over agents.
    runs : independent trainings; 1 for planners.
    over_runs : cost, crash probability and success with intervals over trainings; None for a
        single one.  The intervals above are conditional on the trainings.
    group_costs, group_crashes : per group of episodes in the environment, the mean cost over
        agents and the share of episodes in which any agent crashed; None on schedule.  Players
        with as many groups meet the same noise, so differences of groups are paired.
    paths : (episodes, T + 1, N, n) states of some episodes in the environment; None on schedule.
    """

    information: str
    arrival: tuple[float, ...]
    success: tuple[Estimate, ...] | None
    crash: tuple[Estimate | RareEstimate, ...]
    crash_any: Estimate | RareEstimate
    expected_cost: Interval
    method: str = "mc"
    runs: int = 1
    over_runs: dict[str, Interval] | None = None
    group_costs: tuple[float, ...] | None = None
    group_crashes: tuple[float, ...] | None = None
    paths: np.ndarray | None = None


@dataclass(frozen=True)
class PlayerResult:
    """One player and its simulation; ``played`` is None where there is no plan."""

    entrant: Entrant
    played: Played | None

    @property
    def player(self) -> str:
        """Name of the player."""
        return self.entrant.name

    @property
    def solution(self) -> Solution | None:
        """Solution with its plans; None for policies."""
        return self.entrant.solution

    @property
    def profile(self) -> Profile | None:
        """Plans, if there are any."""
        return None if self.solution is None else self.solution.profile

    @property
    def status(self) -> str:
        """Status of the planner; ``trained``, ``grid`` or ``pairs`` for policies."""
        feedback = self.entrant.feedback
        if feedback is not None:
            return "grid" if isinstance(feedback, FeedbackSolution) else "pairs"
        return "trained" if self.solution is None else str(self.solution.status)

    @property
    def advice(self) -> str:
        """Advice of the planner."""
        return "" if self.solution is None else self.solution.advice


def comparison_report(
    game: Game,
    rows: Sequence[PlayerResult],
    arena: str,
    episodes: int,
    seed: int,
    tolerance: float | None = None,
) -> dict[str, Any]:
    """Return what ``ppg compare --json`` prints."""
    return {
        "scenario": game_name(game),
        "objective": game.objective,
        "collisions": game.collisions,
        "lam": [agent.lam for agent in game.agents],
        "arena": arena,
        "tolerance": tolerance,
        "episodes": episodes,
        "seed": seed,
        "confidence": CONFIDENCE,
        "rows": [row_report(row) for row in rows],
    }


def row_report(row: PlayerResult) -> dict[str, Any]:
    """Return the report of one player."""
    solution, played = row.solution, row.played
    timed = solution or row.entrant.feedback
    head: dict[str, Any] = {
        "player": row.player,
        "status": row.status,
        "advice": row.advice,
        "seconds": None if timed is None else timed.seconds,
    }
    if played is None:
        return head
    if solution is not None and solution.evaluation is not None:
        head |= {**evaluation_report(solution.evaluation), "regret": solution.regret}
    if solution is not None and solution.profile is not None:
        head["between_steps"] = between_steps_report(solution.game, solution.profile)
    spread = played.over_runs or {}
    return {
        **head,
        "information": played.information,
        "runs": played.runs,
        "played_arrival": played.arrival,
        "arrival_mean": float(np.mean(played.arrival)),
        "success": played.success and [estimate_report(share) for share in played.success],
        "crash_probability": estimate_report(played.crash_any),
        "crash_probability_agents": [estimate_report(estimate) for estimate in played.crash],
        "crash_method": played.method,
        "crash_trusted": played.crash_any.trusted,
        "expected_cost": vars(played.expected_cost),
        "over_runs": {name: vars(interval) for name, interval in spread.items()} or None,
        "group_costs": played.group_costs,
        "group_crashes": played.group_crashes,
    }


def estimate_report(estimate: Estimate | RareEstimate) -> dict[str, float]:
    """Return a probability as ``value``, ``low`` and ``high``."""
    return {"value": estimate.value, "low": estimate.low, "high": estimate.high}
