r"""Players side by side in one game: arrival, cost, safety, and crashes from simulation.

Every profile is played open loop on its own schedule with its feedback gain, under the same
noise.  Expected cost is in the money of the ``risk`` objective and of the environment's reward,

    lam_i T_i + (1 - lam_i) kappa Pr(i crashes),       averaged over the agents.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.players import PLAYERS, Limits
from benchmarks.report import evaluation_report, game_name
from ppg_env.game import Game
from ppg_env.montecarlo import CrashCounts, Estimate, crash_counts, proportion
from solvers.solution import Solution

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Interval:
    """A value with the limits of its confidence interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Row:
    """One player's result; crash estimates are None where it has no plan to play."""

    player: str
    solution: Solution
    agents: tuple[Estimate, ...] = ()
    any: Estimate | None = None
    expected_cost: Interval | None = None


def compare(
    game: Game,
    players: Sequence[str],
    episodes: int,
    limits: Limits,
    *,
    workers: int = 1,
    progress: Callable[[str], None] = lambda _player: None,
) -> list[Row]:
    """Let each of ``players`` (names of :data:`PLAYERS`) plan, and simulate ``episodes`` of it."""
    rows = []
    for player in players:
        progress(player)
        solution = PLAYERS[player](game, limits)
        if solution.profile is None:
            rows.append(Row(player, solution))
            continue
        counts = crash_counts(game, solution.profile, episodes, limits.seed, workers=workers)
        each, anybody = counts.estimates(CONFIDENCE)
        rows.append(Row(player, solution, tuple(each), anybody, expected_cost(solution, counts)))
    return rows


def expected_cost(solution: Solution, counts: CrashCounts) -> Interval:
    """Mean expected cost over the agents.

    The limits combine one Clopper-Pearson interval per agent at confidence 1 - 0.05/N, so that
    together they hold with 95 % (Bonferroni).
    """
    agents = solution.game.agents
    each = [
        proportion(int(hits), counts.samples, 1 - (1 - CONFIDENCE) / len(agents))
        for hits in counts.agents
    ]
    assert solution.evaluation is not None
    time = sum(
        agent.lam * (solution.game.horizon if arrival is None else arrival)
        for agent, arrival in zip(agents, solution.evaluation.arrival, strict=True)
    )

    def mean(shares: Sequence[float]) -> float:
        fines = [(1 - agent.lam) * solution.game.crash_cost for agent in agents]
        return float(time + np.dot(fines, shares)) / len(agents)

    return Interval(
        mean([e.value for e in each]), mean([e.low for e in each]), mean([e.high for e in each])
    )


def information(game: Game) -> str:
    """What the players of a plan observe while they play it."""
    return "own state" if any(np.any(agent.gain) for agent in game.agents) else "open loop"


def comparison_report(game: Game, rows: Sequence[Row], episodes: int, seed: int) -> dict[str, Any]:
    """What ``ppg compare --json`` prints."""
    return {
        "scenario": game_name(game),
        "objective": game.objective,
        "lam": [agent.lam for agent in game.agents],
        "arena": "schedule",
        "episodes": episodes,
        "seed": seed,
        "confidence": CONFIDENCE,
        "rows": [_row_report(game, row) for row in rows],
    }


def _row_report(game: Game, row: Row) -> dict[str, Any]:
    solution = row.solution
    head = {
        "player": row.player,
        "status": str(solution.status),
        "advice": solution.advice,
        "information": information(game),
        "seconds": solution.seconds,
    }
    if solution.evaluation is None or row.any is None or row.expected_cost is None:
        return head
    return {
        **head,
        **evaluation_report(solution.evaluation),
        "arrival_mean": arrival_mean(solution),
        "regret": solution.regret,
        "crash_probability": estimate_report(row.any),
        "crash_probability_agents": [estimate_report(estimate) for estimate in row.agents],
        "expected_cost": vars(row.expected_cost),
    }


def arrival_mean(solution: Solution) -> float:
    """Mean arrival over the agents; infinite if one never arrives."""
    assert solution.evaluation is not None
    times = [np.inf if t is None else float(t) for t in solution.evaluation.arrival]
    return float(np.mean(times))


def estimate_report(estimate: Estimate) -> dict[str, float]:
    """A probability as ``value``, ``low`` and ``high``."""
    return {"value": estimate.value, "low": estimate.low, "high": estimate.high}
