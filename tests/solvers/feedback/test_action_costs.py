"""Costs of given actions: the players' own are the least, and lead to the grid's value."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env.env.rules import Rules
from solvers.feedback.grid.action_costs import ActionCosts
from solvers.feedback.grid.dynamic_programming import feedback_equilibrium, feedback_optimum
from solvers.feedback.grid.feedback_solution import FeedbackSolution
from solvers.feedback.grid.frozen_players import Observer
from tests.solvers.feedback.line_games import line_agent, line_game

SLACK = 1e-4
"""Costs that refined actions of both agents in turn may be above the least, on float32 fields."""


@pytest.fixture(scope="module", params=["optimum", "equilibrium"])
def solution(request: pytest.FixtureRequest) -> FeedbackSolution:
    """A fast agent behind a slow one."""
    game = line_game(line_agent(0.0, 40.0), line_agent(25.0, 65.0, -6.0, 6.0))
    return (feedback_optimum if request.param == "optimum" else feedback_equilibrium)(game)


def test_the_players_own_actions_cost_least(solution: FeedbackSolution) -> None:
    random = np.random.default_rng(0)
    starts = np.array([agent.start for agent in solution.game.agents])
    state = starts + random.normal(size=(200, 2, 1)) * 8.0
    clock = np.zeros(200, dtype=np.int64)
    players = solution.players()
    own = [
        player.act(Observer(solution.game, Rules(), i).view(state, clock))
        for i, player in enumerate(players)
    ]
    costs = ActionCosts(solution.policy)
    for i in range(2):
        tried = np.concatenate([own[i][:, None], random.uniform(-9, 9, size=(200, 20, 1))], axis=1)
        together = costs.together(i, state, 0, tried, own[1 - i])
        assert (together[:, :1] <= together[:, 1:] + SLACK).mean() > 0.99
        alone = costs.alone(i, state, 0, tried)
        straight = np.sign(solution.game.agents[i].goal - state[:, i]) * 4.0
        towards = costs.alone(i, state, 0, np.stack([straight, -straight], axis=1))
        assert (towards[:, 0] < towards[:, 1]).mean() > 0.9  # some start behind their goals
        assert (alone <= together + SLACK).mean() > 0.99


def test_the_costs_of_the_first_actions_are_the_value(solution: FeedbackSolution) -> None:
    state = np.array([[agent.start for agent in solution.game.agents]])
    clock = np.zeros(1, dtype=np.int64)
    own = [
        player.act(Observer(solution.game, Rules(), i).view(state, clock))
        for i, player in enumerate(solution.players())
    ]
    costs = ActionCosts(solution.policy)
    ahead = [costs.together(i, state, 0, own[i][:, None], own[1 - i]).item() for i in range(2)]
    lam = [agent.lam for agent in solution.game.agents]
    if solution.kind == "optimum":
        assert ahead == pytest.approx([sum(solution.value) - sum(lam)] * 2, rel=0.01)
    else:
        assert np.add(ahead, lam) == pytest.approx(solution.value, rel=0.01)


@pytest.mark.parametrize("alone", [False, True])
def test_players_return_to_the_grid(solution: FeedbackSolution, alone: bool) -> None:
    grids = solution.policy.model.grids
    low = [grid.low[0] - 25.0 for grid in grids]
    high = [grid.low[0] + grid.step[0] * (grid.shape[0] - 1) + 25.0 for grid in grids]
    state = np.array([low, high])[:, :, None]  # all ends of one step are outside
    clock = np.zeros(2, dtype=np.int64)
    for i, player in enumerate(solution.players()):
        parked = 1 - i if alone else None  # bodies are removed on arrival
        view = Observer(solution.game, Rules(), i).view(state, clock, parked)
        fastest = (10.0, 6.0)[i]
        assert player.act(view)[:, 0] == pytest.approx([fastest, -fastest])
