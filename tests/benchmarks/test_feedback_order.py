"""Feedback optima and equilibria in the paper's scenarios, by paired episodes."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.comparison.players import entrant
from ppg_env import make_game
from ppg_env.env.episodes import evaluate, mean_interval
from ppg_env.game.game import Game
from solvers import best_feedback_response, feedback_equilibrium
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


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("agent", [0, 1])
def test_neither_agent_gains_by_leaving_the_feedback_equilibrium(agent: int) -> None:
    """Between grid states answers may cycle; the last to choose must not profit from that."""
    game = make_game("head_on", speed="l1", objective="risk", lam=0.5)
    players = feedback_equilibrium(game).players()
    deviating = best_feedback_response(game, agent, players).players()
    played, alone = (evaluate(game, team, 20_000, seed=5) for team in (players, deviating))
    gain = mean_interval(played.cost[:, agent] - alone.cost[:, agent])
    assert gain.low <= 0.01 * played.cost[:, agent].mean()
