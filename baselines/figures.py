"""Figures of trained players: costs, crashes and arrivals in the games that training covered."""

from __future__ import annotations

from typing import Any

from baselines.evaluate_runs import evaluate_runs
from baselines.policy_file import Learned
from ppg_env.env.randomize import Randomize
from ppg_env.env.rules import Rules
from ppg_env.game.game import Game
from ppg_env.scenarios.make import override_game

FIGURE_LAMS = (0.2, 0.5, 0.8)
FIGURE_EPISODES = 50_000
"""Figures in a trained player's file: costs and crashes at these lam, from so many episodes."""


def figures(
    game: Game,
    learned: Learned,
    episodes: int = FIGURE_EPISODES,
    *,
    rules: Rules | None = None,
    randomize: Randomize | None = None,
) -> list[dict[str, Any]]:
    """Return cost, crashes and arrivals at each lam of :data:`FIGURE_LAMS` in the trained range.

    Episodes draw what ``randomize`` says; if that includes lam, the only row has no lam.
    """
    low, high = learned.about["lam"] or (1.0, 0.0)
    lams: list[float | None] = [lam for lam in FIGURE_LAMS if low <= lam <= high]
    rows = []
    for lam in lams or [None]:
        played = game if lam is None else override_game(game, lam=lam)
        runs = [learned.players(played, r) for r in range(len(learned.runs))]
        statistics = evaluate_runs(
            played, runs, episodes * len(runs), seed=0, rules=rules, randomize=randomize
        )
        drawn = randomize is not None and randomize.lam is not None
        rows.append(
            {
                "lam": [] if drawn else [agent.lam for agent in played.agents],
                "episodes": episodes,
                **{name: vars(interval) for name, interval in statistics.over_runs().items()},
                "expected_cost_runs": statistics.costs.tolist(),
                "crash_probability_runs": statistics.crashes.tolist(),
                "success_runs": statistics.successes.tolist(),
            }
        )
    return rows
