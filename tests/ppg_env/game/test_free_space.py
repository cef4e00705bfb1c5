"""Free space: proofs that goals are out of reach, and lower bounds on arrivals among walls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope
from ppg_env.game.barriers import barriers
from ppg_env.game.earliest_way import earliest_way
from ppg_env.game.free_space import FreeSpace
from ppg_env.game.plan import make_plan
from ppg_env.game.reachability import earliest_arrival
from solvers import best_response
from tests.marks import first
from tests.oracles.mixed_games import mixed_game


def block(left, low, right, high):
    return Polytope.from_vertices([[left, low], [right, low], [right, high], [left, high]])


def room(gap=0.0):
    """The walls of a square room of side 10, thinner than a step, with a gap on the left."""
    walls = [block(-5, 4.5, 5, 5), block(-5, -5, 5, -4.5), block(4.5, -5, 5, 5)]
    if not gap:
        return [*walls, block(-5, -5, -4.5, 5)]
    return [*walls, block(-5, gap / 2, -4.5, 5), block(-5, -5, -4.5, -gap / 2)]


def walled(walls, collisions="swept", horizon=15, **fields):
    agent = Agent(
        start=[0.0, 0.0],
        goal=[12.0, 0.0],
        shape=Polytope.box([1.0, 1.0]),
        control=Polytope.box([6.0, 6.0]),
        gain=0.5,
        noise=0.01,
        lam=0.8,
    )
    agent = replace(agent, **fields)
    return Game((agent,), walls, horizon=horizon, objective="risk", collisions=collisions)


def test_no_way_leads_out_of_a_closed_room():
    assert earliest_way(walled(room()), 0) is None
    assert earliest_way(walled(room(), horizon=300), 0) is None


def test_a_room_closed_around_the_goal_is_as_closed():
    assert earliest_way(walled(room(), start=[12.0, 0.0], goal=[0.0, 0.0]), 0) is None


def test_at_instants_a_step_jumps_over_the_wall():
    assert earliest_way(walled(room(), "instants"), 0) == 4


@pytest.mark.parametrize(("gap", "arrives"), [(0.9, False), (1.1, True), (2.0, True)])
def test_a_gap_lets_a_body_out_that_fits(gap, arrives):
    assert (earliest_way(walled(room(gap)), 0) is not None) == arrives


def test_the_bound_is_between_the_straight_way_and_a_plan():
    game = walled(room(2.0))
    arrival = best_response(game, 0).evaluation.arrival[0]
    assert earliest_arrival(game.agents[0], 15) <= earliest_way(game, 0) <= arrival


def test_a_wall_that_is_gone_in_time_stands_in_nobodys_way():  # codespell:ignore nobodys
    from ppg_env.game.obstacle import Obstacle

    walls = [Obstacle(wall, until=3) for wall in room()]
    assert earliest_way(walled(walls), 0) == 4


def test_a_workspace_closes_a_room():
    from ppg_env.game.half_spaces import HalfSpaces

    within = HalfSpaces.between([-20.0, -4.0], [20.0, 4.0])
    wall = [block(5.0, -6.0, 5.5, 6.0)]
    assert earliest_way(walled(wall), 0) is not None
    assert earliest_way(walled(wall, within=within), 0) is None


def test_an_agent_that_stays_at_its_start_is_a_wall_where_bodies_stay():
    walls = [block(-9, 0.6, 15, 2), block(-9, -2, 15, -0.6)]
    walls += [block(-10, -2, -9, 2), block(15, -2, 16, 2)]
    game = walled(walls)
    other = replace(game.agents[0], start=[6.0, 0.0], goal=[6.0, 0.0])
    both = replace(game, agents=(*game.agents, other))
    assert earliest_way(both, 0) == 4
    assert earliest_way(replace(both, on_goal="stay"), 0) is None


def test_cells_close_a_space_in_three_dimensions():
    shell = Polytope.box([4.0, 4.0, 0.5])
    walls = []
    for axis in range(3):
        sides = np.full(3, 4.0)
        sides[axis] = 0.5
        shell = Polytope.box(sides).vertices
        walls += [Polytope.from_vertices(shell + sign * 2 * np.eye(3)[axis]) for sign in (1, -1)]
    agent = Agent(
        start=[0.0, 0.0, 0.0],
        goal=[6.0, 0.0, 0.0],
        shape=Polytope.box([1.0, 1.0, 1.0]),
        control=Polytope.box([2.0, 2.0, 2.0]),
        gain=0.5,
        noise=0.0,
    )
    game = Game((agent,), walls, horizon=8, collisions="swept")
    assert earliest_way(game, 0) is None
    assert earliest_way(replace(game, obstacles=game.obstacles[1:]), 0) is not None


WALLED = [0, 2, 3, 4, 7, 8, 13, 15, 16, 19, 21, 24, 25, 26, 28, 31]
"""Seeds of games with an obstacle."""


@pytest.mark.parametrize("collisions", ["instants", "swept"])
@pytest.mark.parametrize("seed", first(2, WALLED))
def test_no_plan_arrives_before_the_bound_or_leaves_the_cells(seed, collisions):
    game = replace(mixed_game(seed).game, collisions=collisions)
    assert game.obstacles
    for i, drawn in enumerate(mixed_game(seed).profile):
        alone = replace(game, agents=(game.agents[i],))
        plan = make_plan(game.agents[i], drawn.controls)
        from ppg_env import evaluate

        if not evaluate(alone, (plan,)).feasible:
            continue
        assert earliest_way(alone, 0) <= plan.arrival
        space = FreeSpace(alone, 0, barriers(alone, 0, {}))
        for _ in space.arrivals():
            pass
        for t in range(plan.arrival):
            where = space.cells.near(plan.means[t, : game.dim])
            assert (space.reached[t] & where).any()


@pytest.mark.parametrize("speed", [2.5, 3.0])
def test_a_body_that_comes_through_a_corridor_cannot_be_passed(speed):
    walls = [block(-9, 0.6, 15, 2), block(-9, -2, 15, -0.6), block(14, -2, 15, 2)]
    walls += [block(-10, -2, -9, 2)]
    game = walled(walls, goal=[8.0, 0.0])
    start = np.array([12.0, 0.0])
    other = replace(game.agents[0], start=start, goal=[-6.0, 0.0])
    both = replace(game, agents=(*game.agents, other))
    controls = np.zeros((15, 2))
    controls[:, 0] = -speed
    coming = make_plan(other, controls)
    space = FreeSpace(both, 0, barriers(both, 0, {1: coming}))
    arrivals = list(space.arrivals())
    # It can only flee to the left until the other has left the game at its goal.
    first = coming.arrival if coming.arrival is not None else 99
    assert all(t > first for t in arrivals)
