"""Costs alone on a finer grid: look-ahead has them where no other agent is."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env.env.rules import Rules
from solvers.feedback.grid.action_costs import ActionCosts
from solvers.feedback.grid.dynamic_programming import feedback_optimum
from solvers.feedback.grid.finer import FINENESS
from solvers.feedback.grid.single_backward import single_stages
from solvers.feedback.grid.single_model import make_single_model
from tests.solvers.feedback.line_games import line_agent, line_game


def test_actions_of_an_agent_alone_have_the_costs_of_the_finer_grid() -> None:
    game = line_game(line_agent(0.0, 40.0), line_agent(25.0, 65.0, -6.0, 6.0))
    solution = feedback_optimum(game, step=2.5)
    rules = Rules().of(game)
    model = make_single_model(game, rules, 0, (), solution.step / FINENESS)
    points = model.grid.points[:, 0]
    inside = points[(points > 3.0) & (points < 60.0)]
    states = np.zeros((len(inside), 2, 1))
    states[:, 0, 0] = inside - 3.0
    actions = np.full((len(inside), 1, 1), 3.0)
    costs, steps = ActionCosts(solution.policy), rules.steps(game)
    for left, (field, _) in enumerate(single_stages(model), 1):
        found = costs.alone(0, states, steps - left, actions)[:, 0]
        expected = np.interp(inside, points, field)
        assert found == pytest.approx(expected, abs=2e-5)
