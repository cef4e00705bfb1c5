"""Flat and one-sided control sets in the simulator: projections, players and warm starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, Simulator, straight_plan
from ppg_env.env.players import GoToGoal, straight_players
from ppg_env.env.rules import Rules
from tests.marks import slow_if
from tests.ppg_env.game.test_least_effort import AGENTS

SETS = {
    "a box of width zero": Polytope.box([20.0, 0.0]),
    "a level segment": Polytope.from_vertices([[-10, 0], [10, 0]]),
    "a slanted segment": Polytope.from_vertices([[2, 1], [8, 4]]),
    "a segment of half-planes": Polytope.from_halfspaces(
        [[1, 2], [-1, -2], [0, 1], [0, -1]], [1, -1, 2, 2]
    ),
    "a point": Polytope.from_vertices([[2, 1]]),
    "the origin": Polytope.box([0.0, 0.0]),
    "a triangle next to zero": Polytope.from_vertices([[1, 0], [3, 0], [3, 2]]),
    "zero on the edge": Polytope.from_vertices([[0, -1], [6, -1], [6, 1], [0, 1]]),
    "an interval on one side": Polytope.from_vertices([[1.0], [3.0]]),
    "one number": Polytope.from_vertices([[2.0]]),
    "a square in space": Polytope.from_vertices([[0, 0, 1], [2, 0, 1], [2, 2, 1], [0, 2, 1]]),
    "a segment in space": Polytope.from_vertices([[0, 0, 1], [3, 6, 7]]),
    "a cube on one side": Polytope.from_halfspaces(
        np.concatenate([-np.eye(3), np.eye(3)]), [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    ),
}


@pytest.mark.parametrize("name", slow_if(lambda name: SETS[name].dim != 2, SETS))
def test_inputs_are_projected_on_the_nearest_point_of_the_set(name: str) -> None:
    control = SETS[name]
    dim, copies = control.dim, 40
    body = Polytope.box([1.0] * dim)
    game = Game((Agent(np.zeros(dim), np.full(dim, 900.0), body, control, noise=0.0),), horizon=5)
    simulator = Simulator(game, Rules(saturation="clip"), copies=copies)
    simulator.reset()
    random = np.random.default_rng(2)
    inputs = random.normal(size=(copies, dim)) * 8
    inputs[:10, -1] = control.vertices[0, -1]  # in line with some sets
    inputs[10:14] = control.vertices.mean(axis=0)
    simulator.step(inputs[:, None, :], restart=False)
    moved = simulator.state[:, 0, :dim]
    assert control.clearance(moved).max() <= 1e-9
    # The nearest point p of a convex set: (u - p).(v - p) <= 0 for every corner v.
    towards = control.vertices[None] - moved[:, None]
    assert np.einsum("ci,cvi->cv", inputs - moved, towards).max() <= 1e-8


@pytest.mark.parametrize("name", slow_if(lambda name: AGENTS[name].state_dim != 2, AGENTS))
def test_players_go_to_the_goal_with_any_set(name: str) -> None:
    agent = replace(AGENTS[name], noise=0.0)
    game = Game((agent,), horizon=30)
    due = straight_plan(agent, 30).arrival
    for player, late in ((straight_players(game)[0], 0), (GoToGoal(game, 0), 6)):
        simulator = Simulator(game, Rules(saturation="clip"), copies=1)
        simulator.reset()
        for _ in range(due + late):
            action = player.act(simulator.view(0))
            if simulator.step(action[:, None, :], restart=False).arrived.any():
                break
        else:
            raise AssertionError(f"not there after {due + late} steps")
