"""Lower bounds on arrivals from the length of ways around bodies, and from their steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope
from ppg_env.game.barriers import barriers
from ppg_env.game.earliest_way import earliest_way, fewest_steps
from ppg_env.game.geodesic import least_steps
from solvers import best_response
from tests.solvers.walled_games import box, room, walled_game


def alone(walls, start, goal, control=None, size=0.5, horizon=30):
    control = Polytope.l1(1.0) if control is None else control
    agent = Agent(start, goal, Polytope.box([size, size]), control, 0.8, 0.5, 0.0)
    return Game((agent,), tuple(walls), horizon, objective="risk", collisions="swept")


def around(game):
    """The bound from the length of a way."""
    bodies = [body for body in barriers(game, 0, {}) if body.rests]
    return least_steps(game.agents[0], bodies, game.horizon)


WALL = box(1.9, -3.0, 2.1, 3.0)
"""A wall across the straight way from (0, 0) to (4, 0); its ends are 3.25 away for a body."""


def test_a_way_around_a_wall_is_as_long_as_its_sides():
    game = alone([WALL], [0.0, 0.0], [4.0, 0.0])
    assert around(game) == int(np.ceil(4 + 2 * 3.25))
    assert earliest_way(game, 0) == 11


def test_speeds_and_directions_set_the_time_of_a_way():
    fast = alone([WALL], [0.0, 0.0], [4.0, 0.0], Polytope.box([2.0, 4.0]))
    assert around(fast) == 4  # four sideways, and 3.25 up and down meanwhile
    forward = Polytope.from_vertices([[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]])
    back = alone([box(1.0, -9.0, 1.2, 9.0)], [0.0, 0.0], [-1.0, 0.0], forward)
    assert around(back) is None


def test_a_way_that_no_body_closes_is_straight():
    assert around(alone([box(1.0, 5.0, 2.0, 6.0)], [0.0, 0.0], [4.0, 0.0])) == 4


def test_steps_end_at_corners():
    walls = [box(0.9, -0.7, 1.1, 0.7), box(-2.0, -0.9, 4.0, -0.7), box(2.9, -0.7, 3.1, 0.7)]
    walls += [box(1.9, -0.1, 2.1, 1.7), *room(-0.6, -0.7, 4.6, 1.3)]
    game = alone(walls, [0.0, 0.0], [4.0, 0.0], size=0.4)
    arrival = best_response(game, 0).evaluation.arrival[0]
    assert (earliest_way(game, 0), fewest_steps(game, 0), arrival) == (9, 11, 11)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_bounds_of_mazes_are_their_optima(seed):
    game = walled_game("maze", seed)
    solution = best_response(game, 0)
    assert earliest_way(game, 0) <= fewest_steps(game, 0) <= solution.evaluation.arrival[0]
    assert solution.bound <= solution.value
    assert around(game) >= 20


def test_corners_that_touch_leave_no_way_but_a_point():
    walls = [box(1.0, 0.0, 2.0, 1.0), box(2.0, -1.0, 3.0, 0.0)]
    game = alone(walls, [0.0, 0.0], [4.0, 0.0], size=0.2)
    assert around(replace(game, horizon=12)) <= best_response(game, 0).evaluation.arrival[0]
