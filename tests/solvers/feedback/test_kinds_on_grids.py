"""Grid values of small games of many kinds against the simulated costs of their policies."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env.env.episodes import evaluate
from ppg_env.env.players import GoToGoal
from ppg_env.env.rules import Rules
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.polytope import Polytope
from solvers import best_feedback_response, feedback_equilibrium, feedback_optimum
from solvers.feedback.grid.frozen_players import Observer
from tests.solvers.feedback.line_games import interval, line_agent, line_game

DOUBLE = np.array([[1.0, 1.0], [0.0, 1.0]])


def simulated(solution, episodes=4096):
    played = evaluate(
        solution.game, solution.players(), episodes, seed=3, rules=solution.rules
    ).cost.mean(axis=0)
    return played[list(solution.agents)]


def cart(start, goal, push=3.0, speed=0.0):
    """A double integrator on a line."""
    return Agent(
        start=[start, speed], goal=[goal], shape=Polytope.box([6.0]), control=interval(-push, push),
        lam=0.8, noise=np.diag([0.4, 0.1]), gain=np.zeros((1, 2)), A=DOUBLE, B=[[0.5], [1.0]],
    )  # fmt: skip


def carts(**more):
    """Behind a slow cart, a fast one has to brake."""
    return Game((cart(0.0, 24.0), cart(14.0, 42.0, 1.5)), objective="risk", crash_cost=50.0,
                horizon=6, **more)  # fmt: skip


def planar(control, **more):
    """Two agents that swap sides, one of them around a block."""
    agents = [
        Agent(start=start, goal=goal, shape=Polytope.box([4.0, 4.0]), control=control, lam=0.8,
              noise=0.8, gain=0.0)
        for start, goal in (([0.0, 0.0], [24.0, 0.0]), ([24.0, 2.0], [0.0, 0.0]))
    ]  # fmt: skip
    block = Obstacle(Polytope.from_vertices([[10, -16], [14, -16], [14, -5], [10, -5]]))
    return Game(tuple(agents), (block,), objective="risk", crash_cost=50.0, horizon=4, **more)


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("collisions", ["instants", "swept"])
def test_double_integrators_on_lines_cost_what_their_values_say(collisions):
    game = carts(collisions=collisions)
    for solve in (feedback_optimum, feedback_equilibrium):
        solution = solve(game, step=1.5)
        assert solution.value == pytest.approx(simulated(solution), rel=0.04)
    response = best_feedback_response(game, 0, [GoToGoal(game, i) for i in range(2)], step=1.5)
    assert response.value == pytest.approx(simulated(response), rel=0.04)


@pytest.mark.slow
def test_double_integrators_far_apart_cost_what_each_costs_alone():
    """The solver for one agent is another program than that for two."""
    game = Game((cart(0.0, 24.0), cart(500.0, 530.0)), objective="risk", horizon=3)
    together = feedback_optimum(game, step=2.0).value
    apart = [
        feedback_optimum(Game((agent,), objective="risk", horizon=3), step=1.0).value[0]
        for agent in game.agents
    ]
    assert together == pytest.approx(apart, rel=0.02)


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("collisions", ["instants", "swept"])
@pytest.mark.parametrize("control", [Polytope.box([16.0, 16.0]), Polytope.disc(8.0, 8)])
def test_control_sets_in_the_plane_cost_what_their_values_say(control, collisions):
    solution = feedback_optimum(planar(control, collisions=collisions), step=2.0)
    assert sum(solution.value) == pytest.approx(simulated(solution).sum(), rel=0.03)


def gate(**more):
    """A line with a gate that shuts at times 2 to 4, on the way of the first agent."""
    path = np.array([[500.0], [500.0], [24.0], [24.0], [24.0], [500.0]])
    shut = Obstacle(Polytope.box([4.0]), path=path)
    return line_game(
        line_agent(0.0, 40.0), line_agent(25.0, 80.0, -6.0, 6.0), obstacles=(shut,), **more
    )


@pytest.mark.slow
@pytest.mark.parametrize("on_crash", ["remove", "continue"])
def test_moving_obstacles_cost_what_the_value_says(on_crash):
    rules = Rules(on_crash=on_crash)
    solution = feedback_optimum(gate(), rules)
    assert not solution.stationary
    assert sum(solution.value) == pytest.approx(simulated(solution).sum(), rel=0.03)
    free = line_game(*gate().agents)
    assert sum(solution.value) > 1.05 * sum(feedback_optimum(free, rules).value)


def test_frozen_players_see_moving_obstacles_as_in_the_environment():
    from ppg_env.env.simulator import Simulator

    game = gate()
    simulator = Simulator(game, copies=3, seed=1)
    simulator.reset()
    for _ in range(3):
        view = simulator.view(1)
        assert view.in_traffic.all()
        copy = Observer(game, simulator.rules, 1).view(view.state.copy(), view.clock.copy())
        assert np.array_equal(copy.obstacles, view.obstacles)
        assert copy.observation == pytest.approx(view.observation, abs=1e-6)
        simulator.step(np.tile([[0.0], [6.0]], (3, 1, 1)))  # past the gate before it shuts
