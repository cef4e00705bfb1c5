"""Beyond the paper: obstacles, polygons, three dimensions, double integrators, unequal agents."""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, evaluate, make_game
from ppg_env.scenarios.make import override_game
from solvers import (
    Status,
    best_response,
    best_response_dynamics,
    certify,
    potential_equilibrium,
    social_optimum,
)
from tests.oracles.slow_evaluator import slow_evaluation

HEXAGON = Polytope.disc(7.0, 6)
KITE = Polytope.from_vertices([[0, 8], [-5, 0], [0, -6], [5, 0]])
OBJECTIVES = ["margin", "risk"]


def polygons(objective, count):
    """Bodies of several shapes, unequal in everything, with a wall in the middle."""
    tilted = [[2.5, 0.8], [0.8, 1.2]]
    agents = (
        Agent([0, 0], [60, 0], HEXAGON, Polytope.disc(10.0), 0.3, 0.5, tilted),
        Agent([60, 18], [0, 8], KITE, Polytope.l1(14.0), 0.8, 0.2, 1.0, sigma0=0.5),
        Agent([30, -30], [30, 40], Polytope.box([6, 9]), Polytope.box([16, 24]), 0.6, 0.9, 0.7),
    )
    wall = Polytope.from_vertices([[26, 14], [40, 10], [38, 20]])
    return Game(agents[:count], (wall,), horizon=7, objective=objective)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_polygons_and_an_obstacle_are_planned_and_priced_as_two_evaluators_say(objective):
    game = polygons(objective, 2)
    social, potential = social_optimum(game), potential_equilibrium(game)
    for solution in (social, potential):
        assert solution.status is Status.OPTIMAL
        assert solution.evaluation.feasible
        found = slow_evaluation(game, [plan.controls for plan in solution.profile])
        np.testing.assert_allclose(solution.evaluation.shifted_cost, found.shifted_cost, atol=1e-6)
    assert social.value == pytest.approx(social.evaluation.shifted_cost.sum(), abs=1e-6)
    assert potential.value == pytest.approx(found.potential, abs=1e-6)
    assert potential.regret.max() <= 1e-5
    assert social.value <= potential.evaluation.social_cost + 1e-6
    assert certify(game, social.profile, charge="pigou").epsilon <= 1e-4


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_three_polygons_and_an_obstacle_come_to_an_equilibrium(objective):
    game = polygons(objective, 3)
    solution = best_response_dynamics(game, start="sequential")
    assert solution.status is Status.EQUILIBRIUM
    assert solution.regret.max() <= 1e-5
    found = slow_evaluation(game, [plan.controls for plan in solution.profile])
    np.testing.assert_allclose(solution.evaluation.shifted_cost, found.shifted_cost, atol=1e-6)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("speed", ["box", "l1"])
def test_one_agent_among_obstacles_is_priced_as_two_evaluators_say(objective, speed):
    game = make_game("course", speed=speed, objective=objective)
    alone = best_response(game, 0)
    assert alone.status is Status.OPTIMAL
    assert alone.evaluation.feasible
    found = slow_evaluation(game, [alone.profile[0].controls])
    assert alone.value == pytest.approx(found.shifted_cost[0], abs=1e-6)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_one_agent_alone_has_one_optimum_whatever_it_is_called(objective):
    game = make_game("course", objective=objective)
    alone, lam = best_response(game, 0).value, game.agents[0].lam
    assert social_optimum(game).value == pytest.approx(alone, abs=1e-6)
    assert potential_equilibrium(game).value == pytest.approx(alone / (1 - lam), abs=1e-6)
    nash = best_response_dynamics(game, start="sequential")
    assert nash.status is Status.EQUILIBRIUM
    assert nash.evaluation.shifted_cost[0] == pytest.approx(alone, abs=1e-5)


def test_an_obstacle_across_the_way_costs_time_and_safety():
    free, walled = make_game("course", obstacles=()), make_game("course")
    assert best_response(free, 0).value == pytest.approx(0.5 * ceil(85 / 10))
    assert best_response(walled, 0).value > best_response(free, 0).value + 1e-3


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_an_agent_walled_in_has_no_plan(objective):
    ring = [
        [(0, 0), (60, 0), (60, 5), (0, 5)],
        [(0, 55), (60, 55), (60, 60), (0, 60)],
        [(0, 0), (5, 0), (5, 60), (0, 60)],
        [(55, 0), (60, 0), (60, 60), (55, 60)],
    ]
    agent = Agent([30, 30], [90, 30], Polytope.box([8, 8]), Polytope.box([10, 10]), gain=0.5)
    game = Game((agent,), tuple(map(Polytope.from_vertices, ring)), objective=objective, horizon=14)
    solution = best_response(game, 0)
    assert solution.status is Status.UNREACHABLE
    assert "agent_0" in solution.advice
    assert solution.profile is None


def cubes(speed, objective, lift=10.0):
    """Two cubes on crossing ways, and ``lift`` the vertical part of their speed."""
    control = Polytope.box([20, 20, 2 * lift]) if speed == "box" else Polytope.l1(10.0, 3)
    body = Polytope.box([15, 15, 15])
    ways = [([0, 30, 0], [60, 30, 0]), ([30, 0, 0], [30, 60, 0])]
    return Game(
        agents=tuple(Agent(s, g, body, control, gain=0.5) for s, g in ways),
        horizon=9,
        objective=objective,
    )


@pytest.mark.parametrize(
    ("speed", "objective"), [("box", "margin"), ("box", "risk"), ("l1", "margin")]
)
def test_a_game_in_space_is_solved_and_judged(speed, objective):
    game = cubes(speed, objective)
    solution = social_optimum(game)
    assert solution.status is Status.OPTIMAL
    assert evaluate(game, solution.profile).feasible
    assert solution.value == pytest.approx(solution.evaluation.social_cost, abs=1e-6)
    assert potential_equilibrium(game).regret.max() <= 1e-5


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_cubes_that_cannot_rise_play_the_game_of_squares(objective):
    flat = cubes("box", objective, lift=0.0)
    squares = Game(
        agents=tuple(
            Agent(a.start[:2], a.goal[:2], Polytope.box([15, 15]), Polytope.box([20, 20]), gain=0.5)
            for a in flat.agents
        ),
        horizon=flat.horizon,
        objective=objective,
    )
    assert social_optimum(flat).value == pytest.approx(social_optimum(squares).value, abs=1e-6)


def test_room_to_rise_never_costs_anything():
    for objective in OBJECTIVES:
        flat, free = cubes("box", objective, lift=0.0), cubes("box", objective)
        assert social_optimum(free).value <= social_optimum(flat).value + 1e-6


def car(start, goal, dim, **changes):
    """A double integrator: position and velocity, the input an acceleration of at most 1."""
    one, none = np.eye(dim), np.zeros((dim, dim))
    values = {
        "shape": Polytope.box([1.0] * dim),
        "control": Polytope.box([2.0] * dim),
        "A": np.block([[one, one], [none, one]]),
        "B": np.vstack([0.5 * one, one]),
        "gain": np.hstack([0.3 * one, 0.8 * one]),
        "noise": 0.01,
    }
    return Agent(start=start, goal=goal, **(values | changes))


@pytest.mark.parametrize("distance", [0.5, 2.0, 8.0, 9.0, 10.0])
@pytest.mark.parametrize("dim", [1, 2])
def test_a_car_that_may_fly_through_its_goal_takes_the_root_of_twice_the_way(distance, dim):
    # At full throttle from rest, t^2/2 in t steps; any way up to that can be met.
    agent = car(np.zeros(2 * dim), np.r_[distance, np.zeros(dim - 1)], dim)
    solution = best_response(Game((agent,), horizon=10), 0)
    assert solution.evaluation.arrival == (ceil(sqrt(2 * distance)),)
    assert solution.value == pytest.approx(0.5 * ceil(sqrt(2 * distance)))


@pytest.mark.parametrize("distance", [0.5, 2.0, 8.0, 9.0, 10.0])
@pytest.mark.parametrize("dim", [1, 2])
def test_a_car_that_must_stop_at_its_goal_takes_the_root_of_four_times_the_way(distance, dim):
    # Half the time at full throttle, half on the brakes: t^2/4 in t steps, (t^2 - 1)/4 if odd.
    goal = np.zeros(2 * dim)
    goal[0] = distance
    solution = best_response(Game((car(np.zeros(2 * dim), goal, dim),), horizon=10), 0)
    steps = next(t for t in range(11) if (t**2 - t % 2) / 4 >= distance)
    assert solution.evaluation.arrival == (steps,)
    np.testing.assert_allclose(solution.profile[0].means[steps], goal, atol=1e-6)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("whole", [True, False])
def test_two_cars_at_a_crossing_reach_an_equilibrium(objective, whole):
    ends = [([0, 6, 0, 0], [12, 6, 0, 0]), ([6, 0, 0, 0], [6, 12, 0, 0])]
    agents = tuple(car(s, g if whole else g[:2], 2, lam=0.7) for s, g in ends)
    game = Game(agents, horizon=10, objective=objective)
    for solution in (social_optimum(game), potential_equilibrium(game)):
        assert solution.status is Status.OPTIMAL
        assert solution.evaluation.feasible
        found = slow_evaluation(game, [plan.controls for plan in solution.profile])
        np.testing.assert_allclose(solution.evaluation.shifted_cost, found.shifted_cost, atol=1e-6)
        for agent, plan in zip(game.agents, solution.profile, strict=True):
            there = plan.means[plan.arrival][: agent.goal.size]
            np.testing.assert_allclose(there, agent.goal, atol=1e-6)
    assert solution.regret.max() <= 1e-5


def test_one_input_may_drive_two_states():
    # A point that moves along the diagonal only, whatever it does.
    agent = Agent(
        start=[0, 0],
        goal=[12, 12],
        shape=Polytope.box([1, 1]),
        control=Polytope.box([10.0]),
        B=[[1.0], [1.0]],
        gain=[[0.25, 0.25]],
    )
    solution = best_response(Game((agent,), horizon=5), 0)
    assert solution.evaluation.arrival == (3,)
    assert best_response(Game((agent,), horizon=2), 0).status is Status.UNREACHABLE


def test_more_than_four_agents_find_an_equilibrium():
    game = make_game("circle(6)")
    solution = best_response_dynamics(game)
    assert solution.status is Status.EQUILIBRIUM
    assert solution.evaluation.feasible
    assert solution.regret.max() <= 1e-5


def test_a_change_of_units_changes_nothing():
    """Lengths in half units, noise in quarter units: margins and costs stay."""
    game = make_game("intersection", speed="l1")
    agents = game.agents
    half = override_game(
        game,
        start={i: a.start / 2 for i, a in enumerate(agents)},
        goal={i: a.goal / 2 for i, a in enumerate(agents)},
        noise={i: a.noise / 4 for i, a in enumerate(agents)},
        shape=Polytope.box([7.5, 7.5]),
        control=Polytope.l1(5.0),
    )
    assert social_optimum(half).value == pytest.approx(social_optimum(game).value, abs=1e-5)
