"""One agent without others on a grid of up to four axes, against chains and simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import make_game
from ppg_env.env.episodes import evaluate
from ppg_env.env.players import GoToGoal
from ppg_env.env.rules import Rules
from ppg_env.errors import InputError
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.polytope import Polytope
from solvers import best_feedback_response, feedback_optimum, write_feedback
from tests.solvers.feedback.line_games import LAM, alone, line_agent, overlap

PLANE = np.eye(4) + np.eye(4, k=2)
"""A double integrator in the plane: positions, then velocities."""

WIDE = Rules(tolerance=3.0)
"""Without it, the region would be narrow across the way: a straight plan does not move there."""


def spacecraft(control=None, **more):
    """A double integrator in the plane that has to get around a block."""
    agent = Agent(
        start=[0.0, 0.0, 0.0, 0.0], goal=[30.0, 0.0], shape=Polytope.box([4.0, 4.0]),
        control=Polytope.box([6.0, 6.0]) if control is None else control, lam=LAM,
        noise=np.diag([0.4, 0.4, 0.1, 0.1]), gain=np.zeros((2, 4)), A=PLANE,
        B=np.vstack([0.5 * np.eye(2), np.eye(2)]),
    )  # fmt: skip
    return Game((agent,), objective="risk", crash_cost=50.0, horizon=6, **more)


def block(**more):
    return Obstacle(Polytope.from_vertices([[13, -3], [17, -3], [17, 8], [13, 8]]), **more)


def simulated(solution, episodes=4096):
    return evaluate(
        solution.game, solution.players(), episodes, seed=3, rules=solution.rules
    ).cost.mean()


def test_one_agent_on_a_line_agrees_with_a_chain():
    game = Game((line_agent(0.0, 40.0),), objective="risk", crash_cost=100.0, horizon=10)
    solution = feedback_optimum(game, step=1.25)
    assert solution.stationary
    assert solution.value[0] == pytest.approx(alone(0.0, 40.0, 20), rel=0.003)
    same = best_feedback_response(game, 0, [GoToGoal(game, 0)], step=1.25)
    assert same.value == solution.value


def test_an_obstacle_costs_its_probability():
    wall = Obstacle(Polytope.from_vertices([[20.0], [30.0]]))
    game = Game(
        (line_agent(0.0, 200.0, 10.0, 10.5),), (wall,), objective="risk", crash_cost=100.0,
        horizon=10,
    )  # fmt: skip
    value = feedback_optimum(game, Rules(max_cycles=1), step=2.5).value[0]
    assert value == pytest.approx(LAM + (1 - LAM) * 100 * overlap(17.5, 1.9), rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("control", [Polytope.box([6.0, 6.0]), Polytope.disc(3.0, 8)])
@pytest.mark.parametrize("collisions", ["instants", "swept"])
def test_a_double_integrator_in_the_plane_costs_what_its_value_says(control, collisions):
    game = spacecraft(control, obstacles=(block(),), collisions=collisions)
    solution = feedback_optimum(game, WIDE, step=2.0)
    free = feedback_optimum(spacecraft(control, collisions=collisions), WIDE, step=2.0)
    assert free.value[0] < solution.value[0]
    assert solution.value[0] == pytest.approx(simulated(solution), rel=0.06)


@pytest.mark.slow
def test_a_moving_block_is_met_at_its_time():
    path = np.array([[0.0, -40.0], [0.0, -20.0], [0.0, -2.0], [0.0, 2.0], [0.0, 40.0]])
    shape = Polytope.from_vertices([[10, -4], [20, -4], [20, 4], [10, 4]])
    game = spacecraft(obstacles=(Obstacle(shape, path=path),))
    solution = feedback_optimum(game, WIDE, step=2.0)
    assert solution.value[0] == pytest.approx(simulated(solution), rel=0.06)
    assert solution.value[0] > feedback_optimum(spacecraft(), WIDE, step=2.0).value[0]


def test_limits_and_games_that_do_not_fit_end_with_words(tmp_path):
    game = spacecraft()
    with pytest.raises(InputError, match=r"memory_limit.*GB are needed"):
        feedback_optimum(game, memory_limit=1e4)
    with pytest.raises(InputError, match=r"time_limit.*1 of 12 stages"):
        feedback_optimum(game, step=8.0, time_limit=0.0)
    in_space = make_game("intersection_3d")
    in_space = replace(in_space, agents=in_space.agents[:2])
    with pytest.raises(InputError, match="is in space"):
        feedback_optimum(in_space)
    line = Game((line_agent(0.0, 40.0),), objective="risk", horizon=3)
    with pytest.raises(InputError, match="is of one agent alone"):
        write_feedback(tmp_path / "policy.npz", feedback_optimum(line))
