r"""Players side by side in one game: arrival, cost, safety, and crashes from simulation.

Two arenas, never mixed in one table:

    schedule   every profile runs on its own schedule with its feedback gain, as the paper counts:
               agent i leaves at its planned T_i, inputs are not limited, crashed agents go on
    env        the environment under its default rules: arrival within a region, inputs projected
               on the control set, crashed agents leave

All players meet the same noise.  Expected cost is in the money of the ``risk`` objective and of
the environment's reward, lam per step and (1 - lam) kappa for a crash, averaged over the agents.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from baselines.evaluate_runs import (
    OF_A_LEVEL,
    RunStatistics,
    evaluate_rare_runs,
    evaluate_runs,
    over_runs,
)
from benchmarks.comparison.planner_options import PlannerOptions
from benchmarks.comparison.players import RECEDING, Entrant, entrant
from benchmarks.comparison.report import evaluation_report, game_name
from ppg_env.env.episodes import trajectories
from ppg_env.env.players import information, track
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from ppg_env.risk.importance_sampling import IN_SIGHT, crash_weights
from ppg_env.risk.monte_carlo import crash_counts
from ppg_env.support.statistics import Estimate, Interval, RareEstimate
from solvers.solution import Solution

CONFIDENCE = 0.95

FEW = 10
"""Crashes below which counting says little, and rare ones are sampled (``ppg risk``'s rare)."""

PATHS = 40
"""Episodes that are drawn."""


@dataclass(frozen=True)
class Played:
    """What simulation showed of a player.

    Attributes
    ----------
    information : what it observes: open loop, own state or full state.
    arrival : per agent its arrival time, or in ``env`` the mean over episodes that arrive.
    success : per agent the share of episodes that arrive; None on schedule.
    crash, crash_any : crash probability per agent and of anybody.
    method : how it was found, ``mc`` or, where that saw fewer than ``FEW``, ``rare``.
    expected_cost : mean over agents.
    runs : independent trainings behind it; 1 for planners.
    over_runs : cost, crash probability and success with their intervals over trainings, None for a
        single one.  Those above take the trainings as given.
    paths : (episodes, T + 1, N, n) some episodes' states in the environment; None on schedule.
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
    paths: np.ndarray | None = None


@dataclass(frozen=True)
class PlayerResult:
    """One player and its simulation; ``played`` is None where there is no plan."""

    entrant: Entrant
    played: Played | None

    @property
    def player(self) -> str:
        """Its name."""
        return self.entrant.name

    @property
    def solution(self) -> Solution | None:
        """Its plans; None for learners."""
        return self.entrant.solution

    @property
    def profile(self) -> Profile | None:
        """Its plans, if it has any."""
        return None if self.solution is None else self.solution.profile

    @property
    def status(self) -> str:
        """How its planner ended; ``trained`` for learners."""
        return "trained" if self.solution is None else str(self.solution.status)

    @property
    def advice(self) -> str:
        """Its planner's advice."""
        return "" if self.solution is None else self.solution.advice


def compare(
    game: Game,
    players: Sequence[str],
    episodes: int,
    planner: PlannerOptions,
    *,
    arena: str = "schedule",
    workers: int = 1,
    groups: int = 1,
    progress: Callable[[str], None] = lambda _player: None,
) -> list[PlayerResult]:
    """Let each of ``players`` plan or load, and simulate ``episodes`` of it in ``arena``.

    In ``env`` the episodes are shared out among the runs of the learners, or into as many
    ``groups`` if those are more.
    """
    entrants = []
    for player in players:
        progress(player)
        entrants.append(entrant(player, game, planner))
    groups = max(groups, *(one.runs for one in entrants))
    rows = []
    for one in entrants:
        progress(one.name)
        played = None
        if arena == "schedule":
            profile = None if one.solution is None else one.solution.profile
            if profile is not None:
                played = _on_schedule(game, profile, episodes, planner.seed, workers)
        elif runs := one.policies(game, planner):
            count = groups if one.runs == 1 else one.runs
            judged = evaluate_runs(game, runs, episodes, planner.seed, groups=count)
            paths = trajectories(game, runs[0], min(PATHS, episodes), planner.seed)
            played = _in_environment(judged, one.runs, information(runs[0]), paths)
            if judged.summary.crash_any.hits < FEW and one.name != RECEDING:
                amount = min(episodes, OF_A_LEVEL)
                found = evaluate_rare_runs(game, runs, amount, planner.seed)
                played = replace(
                    played, crash=tuple(found.agents), crash_any=found.any, method="rare"
                )
        rows.append(PlayerResult(one, played))
    return rows


def _in_environment(judged: RunStatistics, runs: int, seen: str, paths: np.ndarray) -> Played:
    found = judged.summary
    spread = None
    if runs > 1:
        spread = {
            "expected_cost": over_runs(judged.costs, 0.0),
            "crash_probability": over_runs(judged.crashes, 0.0, 1.0),
            "success": over_runs(judged.successes, 0.0, 1.0),
        }
    return Played(
        information=seen,
        arrival=tuple(mean.value for mean in found.arrival),
        success=tuple(found.success),
        crash=tuple(found.crash),
        crash_any=found.crash_any,
        expected_cost=found.cost_mean,
        runs=runs,
        over_runs=spread,
        paths=paths,
    )


def _on_schedule(game: Game, profile: Profile, episodes: int, seed: int, workers: int) -> Played:
    times = tuple(float("inf") if plan.arrival is None else plan.arrival for plan in profile)
    level = 1 - (1 - CONFIDENCE) / len(game.agents)
    counts = crash_counts(game, profile, episodes, seed, workers=workers)
    each, anybody = counts.estimates(CONFIDENCE)
    played = Played(
        information=information(track(game, profile)),
        arrival=times,
        success=None,
        crash=tuple(each),
        crash_any=anybody,
        expected_cost=expected_cost(game, times, counts.each(counts.agents, level)),
    )
    if counts.any >= FEW:
        return played
    weights = crash_weights(game, profile, min(episodes, IN_SIGHT), seed, workers=workers)
    usual, surer = weights.risk(CONFIDENCE), weights.risk(level)
    return replace(
        played,
        crash=tuple(usual.agents),
        crash_any=usual.any,
        method="rare",
        expected_cost=expected_cost(game, times, surer.agents),
    )


def expected_cost(
    game: Game, arrival: Sequence[float], crash: Sequence[Estimate | RareEstimate]
) -> Interval:
    """Mean over agents of lam T + (1 - lam) kappa Pr(crash).

    Each agent's ``crash`` is an interval at confidence 1 - 0.05/N, so that together they hold with
    95 % (Bonferroni).
    """
    time = sum(agent.lam * t for agent, t in zip(game.agents, arrival, strict=True))
    fines = [(1 - agent.lam) * game.crash_cost for agent in game.agents]

    def mean(shares: Sequence[float]) -> float:
        return float(time + np.dot(fines, shares)) / len(game.agents)

    return Interval(
        mean([e.value for e in crash]), mean([e.low for e in crash]), mean([e.high for e in crash])
    )


def comparison_report(
    game: Game, rows: Sequence[PlayerResult], arena: str, episodes: int, seed: int
) -> dict[str, Any]:
    """What ``ppg compare --json`` prints."""
    return {
        "scenario": game_name(game),
        "objective": game.objective,
        "lam": [agent.lam for agent in game.agents],
        "arena": arena,
        "episodes": episodes,
        "seed": seed,
        "confidence": CONFIDENCE,
        "rows": [row_report(row) for row in rows],
    }


def row_report(row: PlayerResult) -> dict[str, Any]:
    """One of its rows."""
    solution, played = row.solution, row.played
    head: dict[str, Any] = {
        "player": row.player,
        "status": row.status,
        "advice": row.advice,
        "seconds": None if solution is None else solution.seconds,
    }
    if played is None:
        return head
    if solution is not None and solution.evaluation is not None:
        head |= {**evaluation_report(solution.evaluation), "regret": solution.regret}
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
    }


def estimate_report(estimate: Estimate | RareEstimate) -> dict[str, float]:
    """A probability as ``value``, ``low`` and ``high``."""
    return {"value": estimate.value, "low": estimate.low, "high": estimate.high}
