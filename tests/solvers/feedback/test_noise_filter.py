from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import make_game
from ppg_env.game.agent import Agent
from ppg_env.game.polytope import Polytope
from solvers.feedback.grid.noise_filter import make_noise_filter
from solvers.feedback.grid.state_grid import Grid, make_grid


def planar(noise) -> tuple[Agent, Grid]:
    game = make_game("head_on", noise=noise)
    return game.agents[0], make_grid(game, 0, 5.0)


def smooth(points: np.ndarray) -> np.ndarray:
    return 2.0 + np.sin(points[..., 0] / 25.0) + np.cos(points[..., 1] / 20.0)


@pytest.mark.parametrize("noise", [[[1.9, 0.0], [0.0, 4.0]], [[3.0, 1.5], [1.5, 2.0]]])
def test_traffic_is_the_expectation_over_states_outside_the_region(noise):
    agent, grid = planar(noise)
    made = make_noise_filter(agent, grid, np.full(agent.goal.size, 5.0))
    field = made.traffic(smooth(grid.points).astype(np.float32))
    draws = np.random.default_rng(0).multivariate_normal([0, 0], noise, size=100_000)
    for offset in ([0.0, 0.0], [5.0, 0.0], [5.0, 5.0], [-20.0, 5.0]):
        state = agent.goal + offset
        ends = state + draws
        out = np.abs(ends - agent.goal).max(axis=1) > 5.0
        place = grid.nearest(state)
        assert grid.points[place] == pytest.approx(state)
        assert made.stays[place] == pytest.approx(out.mean(), abs=8e-3)
        assert field[place] == pytest.approx((smooth(ends) * out).mean(), abs=2.5e-2)


def test_many_columns_are_filtered_as_one():
    agent, grid = planar(1.9)
    made = make_noise_filter(agent, grid, np.full(agent.goal.size, 5.0))
    values = np.random.default_rng(1).normal(size=(grid.size, 3)).astype(np.float32)
    together = made.traffic(values, 3)
    for k in range(3):
        alone = made.traffic(np.ascontiguousarray(values[:, k]))
        assert together[:, k] == pytest.approx(alone, abs=1e-5)


def test_an_agent_without_noise_stays_where_it_goes():
    agent = Agent(
        start=[0.0], goal=[20.0], shape=Polytope.box([5.0]), control=Polytope.box([20.0]), noise=0.0
    )
    game = make_game("head_on")
    other = replace(agent, start=np.array([60.0]), goal=np.array([90.0]))
    game = replace(game, agents=(agent, other))
    grid = make_grid(game, 0, 2.5)
    made = make_noise_filter(agent, grid, np.full(agent.goal.size, 5.0))
    field = made.traffic(np.ones(grid.size, np.float32))
    inside = np.abs(grid.points[:, 0] - 20.0) <= 5.0
    assert np.array_equal(field, (~inside).astype(np.float32))
