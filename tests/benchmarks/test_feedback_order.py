"""No player costs less than the feedback optimum, in paired episodes of the paper's scenarios."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.comparison.players import entrant
from ppg_env import make_game
from ppg_env.env.episodes import evaluate, mean_interval
from ppg_env.game.game import Game
from solvers.planner_options import PlannerOptions

OTHERS = ("feedback-nash", "social", "nash", "receding-social", "receding-nash")
LEARNED = ("ppo-social", "ppo-selfish")
EPISODES, REPLANNED = 8192, 512
"""Episodes, and those of players that plan again at every step, a few hundred times a second."""


def costs(name: str, game: Game) -> list[np.ndarray]:
    """Return the mean cost of each episode of each run."""
    planner = PlannerOptions(time_limit=1800.0)
    runs = entrant(name, game, planner).policies(game, planner)
    episodes = REPLANNED if name.startswith("receding") else EPISODES
    return [evaluate(game, players, episodes, seed=5).cost.mean(axis=1) for players in runs]


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("lam", [0.5, 0.8])
@pytest.mark.parametrize("speed", ["l1", "box", "disc"])
@pytest.mark.parametrize("scenario", ["head_on", "intersection", "opposing", "parallel"])
def test_no_player_costs_less_than_the_feedback_optimum(
    scenario: str, speed: str, lam: float
) -> None:
    game = make_game(scenario, speed=speed, objective="risk", lam=lam)
    [least] = costs("feedback-social", game)
    for name in (*OTHERS, *LEARNED):
        for run, other in enumerate(costs(name, game)):
            gain = mean_interval(least[: len(other)] - other)
            assert gain.low <= 0.0, (name, run, gain)
