r"""Players side by side in one game: arrival, cost, safety, and crashes from simulation.

Two arenas, never mixed in one table:

    schedule   every profile runs on its own schedule with its feedback gain, as in the paper:
               agent i leaves at its planned T_i, inputs are not limited, crashed agents go on
    env        the environment under its default rules: arrival within a region, inputs projected
               on the control set, crashed agents leave

All players have the same noise.  The expected cost is that of the ``risk`` objective and of the
environment's reward, lam per step and (1 - lam) kappa for a crash, averaged over the agents.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from baselines.evaluate_runs import (
    OF_A_LEVEL,
    evaluate_rare_runs,
    evaluate_runs,
)
from benchmarks.comparison.players import REPLANNING, Entrant, entrants
from benchmarks.comparison.results import CONFIDENCE, Played, PlayerResult
from ppg_env.env.arrival_regions import checked_tolerances
from ppg_env.env.episodes import trajectories
from ppg_env.env.players import information, track
from ppg_env.env.rules import Rules
from ppg_env.game.game import Game
from ppg_env.risk.importance_sampling import IN_SIGHT, crash_weights
from ppg_env.risk.monte_carlo import crash_counts
from ppg_env.support.statistics import Estimate, Interval, RareEstimate
from solvers.planner_options import PlannerOptions

FEW = 10
"""With fewer counted crashes the rare-event method of ``ppg risk`` is used."""

PATHS = 40
"""Episodes that are drawn."""


def compare(
    game: Game,
    players: Sequence[str],
    episodes: int,
    planner: PlannerOptions,
    *,
    arena: str = "schedule",
    workers: int = 1,
    groups: int = 1,
    tolerance: float | None = None,
    progress: Callable[[str], None] = lambda _player: None,
) -> list[PlayerResult]:
    """Plan or load each of ``players``, and simulate ``episodes`` of it in ``arena``.

    In ``env`` the episodes are divided among the runs of the learners, or among ``groups`` if there
    are more of these; agents arrive within ``tolerance`` of their goals.
    """
    rules = Rules(tolerance=tolerance)
    if arena == "env":  # before the players plan
        checked_tolerances(game, rules)
    planned = entrants(players, game, planner, progress)
    groups = max(groups, *(ready.runs for ready in planned))
    rows = []
    for ready in planned:
        progress(ready.name)
        if arena == "schedule":
            played = _on_schedule(game, ready, episodes, planner.seed, workers)
        else:
            played = _in_environment(game, ready, episodes, planner, groups, rules)
        rows.append(PlayerResult(ready, played))
    return rows


def _in_environment(
    game: Game,
    ready: Entrant,
    episodes: int,
    planner: PlannerOptions,
    groups: int,
    rules: Rules,
) -> Played | None:
    runs, seed = ready.policies(game, planner), planner.seed
    if not runs:
        return None
    count = groups if ready.runs == 1 else ready.runs
    statistics = evaluate_runs(game, runs, episodes, seed, groups=count, rules=rules)
    summary = statistics.summary
    played = Played(
        information=information(runs[0]),
        arrival=tuple(mean.value for mean in summary.arrival),
        success=tuple(summary.success),
        crash=tuple(summary.crash),
        crash_any=summary.crash_any,
        expected_cost=summary.cost_mean,
        runs=ready.runs,
        over_runs=statistics.over_runs() if ready.runs > 1 else None,
        group_costs=tuple(statistics.costs.tolist()),
        group_crashes=tuple(statistics.crashes.tolist()),
        paths=trajectories(game, runs[0], min(PATHS, episodes), seed, rules=rules),
    )
    if summary.crash_any.hits >= FEW or ready.name in REPLANNING:  # not split
        return played
    rare = evaluate_rare_runs(game, runs, min(episodes, OF_A_LEVEL), seed, rules=rules)
    return replace(played, crash=tuple(rare.agents), crash_any=rare.any, method="rare")


def _on_schedule(
    game: Game, ready: Entrant, episodes: int, seed: int, workers: int
) -> Played | None:
    profile = None if ready.solution is None else ready.solution.profile
    if profile is None:
        return None
    times = tuple(float("inf") if plan.arrival is None else plan.arrival for plan in profile)
    level = 1 - (1 - CONFIDENCE) / len(game.agents)
    counts = crash_counts(game, profile, episodes, seed, workers=workers)
    each, of_any = counts.estimates(CONFIDENCE)
    played = Played(
        information=information(track(game, profile)),
        arrival=times,
        success=None,
        crash=tuple(each),
        crash_any=of_any,
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
    """Return the mean over agents of lam T + (1 - lam) kappa Pr(crash).

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
