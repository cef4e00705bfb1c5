"""Policies from pairs: exact where a third agent is far away, and good where three meet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env.env.episodes import evaluate
from ppg_env.env.players import GoToGoal
from ppg_env.env.rules import Rules
from ppg_env.errors import InputError
from ppg_env.game.game import Game
from ppg_env.game.polytope import Polytope
from solvers.feedback.grid.action_costs import ActionCosts
from solvers.feedback.grid.pairwise import pairwise_policies
from solvers.feedback.grid.pairwise_player import Scene, within
from tests.solvers.feedback.line_games import line_agent, line_game

EPISODES = 1000


def three(last: float) -> Game:
    """A fast agent behind a slow one, and a third that starts at ``last``."""
    return line_game(
        line_agent(0.0, 40.0),
        line_agent(25.0, 65.0, -6.0, 6.0),
        line_agent(last, last + 40.0, -5.0, 5.0),
        horizon=12,
    )


@pytest.mark.parametrize("social", [True, False])
def test_agents_far_from_a_third_act_as_the_pair_does(social: bool) -> None:
    game = three(1000.0)
    solution = pairwise_policies(game, social=social, step=2.5)
    random = np.random.default_rng(0)
    starts = np.array([agent.start for agent in game.agents])
    states = starts + random.normal(size=(100, 3, 1)) * 5.0
    actions = solution.policy.actions(Scene(0, states, np.ones((100, 3), dtype=bool)))
    pair = ActionCosts(solution.pairs[0, 1].policy)
    tried = np.linspace(-10, 10, 81).reshape(1, -1, 1).repeat(100, axis=0)
    for i in range(2):
        own, other = actions[:, i, None], actions[:, 1 - i]
        cost = pair.together(i, states[:, :2], 0, own, other)[:, 0]
        least = pair.together(i, states[:, :2], 0, tried, other).min(axis=1)
        assert (cost - least).max() < 0.02


def test_three_in_a_row_cost_less_than_those_that_go_straight() -> None:
    game = three(50.0)
    both = [pairwise_policies(game, social=social, step=2.5).players() for social in (False, True)]
    straight = [GoToGoal(game, i) for i in range(3)]
    costs = [evaluate(game, players, EPISODES, seed=0).cost.mean() for players in (*both, straight)]
    assert max(costs[:2]) < costs[2] - 5.0


def test_an_agent_alone_costs_what_it_costs_in_its_pairs() -> None:
    game = three(1000.0)
    solution = pairwise_policies(game, social=True, step=2.5)
    states = np.array([agent.start for agent in game.agents])[None].repeat(3, axis=0)
    traffic = np.eye(3, dtype=bool)
    actions = solution.policy.actions(Scene(0, states, traffic))
    assert (actions[~traffic] == 0.0).all()
    assert actions[traffic].ravel() == pytest.approx([10.0, 6.0, 5.0])


def test_steps_end_at_the_border_of_the_control_set() -> None:
    control = Polytope.l1(10.0)
    middle = np.array([[[4.0, 4.0]], [[0.0, 0.0]]])
    ends = within(control, middle, np.array([[4.0, 0.0], [0.0, -3.0], [0.0, 0.0]]))
    assert ends[0] == pytest.approx(np.array([[6.0, 4.0], [4.0, 1.0], [4.0, 4.0]]))
    assert ends[1] == pytest.approx(np.array([[4.0, 0.0], [0.0, -3.0], [0.0, 0.0]]))


def test_one_agent_and_bodies_that_stay_are_refused() -> None:
    game = three(50.0)
    with pytest.raises(InputError, match="has one agent"):
        pairwise_policies(replace(game, agents=game.agents[:1]), social=True)
    with pytest.raises(InputError, match="on_goal"):
        pairwise_policies(game, Rules(on_goal="stay"), social=True)


def test_a_limit_on_memory_is_for_all_pairs() -> None:
    with pytest.raises(InputError, match="memory_limit"):
        pairwise_policies(three(50.0), social=True, step=2.5, memory_limit=1e4)
