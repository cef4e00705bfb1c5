"""Tiny games in motion, where every choice of arrivals and faces is a linear program to solve."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, make_profile
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.obstacle import Obstacle
from solvers import Status, best_response, potential_equilibrium, social_optimum
from tests.marks import first
from tests.oracles.enumeration import enumerated_optimum

MOTIONS = [*product(["swept", "instants"], ["stay", "remove"])]
NEAR = {"rel": 1e-6, "abs": 1e-6}


def line(collisions, on_goal, **changes):
    """Two unequal bodies on a line; the second leaves the way of the first, or must wait."""
    one = {"lam": 0.6, "gain": 0.5, "noise": 0.3, "effort": 0.05} | changes
    other = {"lam": 0.3, "gain": 0.0, "noise": 0.1, "effort": 0.2} | changes
    agents = (
        Agent([0.0], [5.0], Polytope.box([1.0]), Polytope.box([5.0]), **one),
        Agent([4.0], [8.0], Polytope.box([1.5]), Polytope.box([3.0]), **other),
    )
    return Game(agents, horizon=4, collisions=collisions, on_goal=on_goal)


def crossing(collisions, on_goal, **changes):
    """Two bodies that cross in the plane in two or three steps, one of them in a corridor."""
    one = {"lam": 0.7, "gain": 0.5, "noise": 0.4, "effort": 0.02} | changes
    other = {"lam": 0.4, "gain": 0.2, "noise": 0.2, "effort": 0.1} | changes
    fence = HalfSpaces.between([-2.0, -2.0], [6.0, 1.5], sigmas=0.5)
    agents = (
        Agent(
            [0, 0], [4, 0], Polytope.box([1, 1]), Polytope.l1(2.5, 2),
            within=(fence,), reserve=0.5, **one,
        ),
        Agent([2, -2], [2, 2], Polytope.box([1, 1]), Polytope.box([2, 5]), **other),
    )  # fmt: skip
    return Game(agents, horizon=3, collisions=collisions, on_goal=on_goal)


def sweeper(collisions, on_goal, until=None):
    """A double integrator on a line that waits for an obstacle that crosses its way."""
    car = Agent(
        [0.0, 0.0], [4.0], Polytope.box([1.0]), Polytope.box([4.0]),
        A=[[1, 1], [0, 1]], B=[[0.5], [1]], lam=0.5, noise=0.1 * np.eye(2), effort=0.1,
        gain=[[0.2, 0.5]], within=(HalfSpaces.between([-np.inf, -1.8], [np.inf, 1.8], 0.5),),
    )  # fmt: skip
    path = np.array([[2.0], [3.0], [6.0], [8.0]])
    shuttle = Obstacle(Polytope.box([1.0]), path=path, noise=0.1, until=until)
    return Game((car,), (shuttle,), horizon=5, collisions=collisions, on_goal=on_goal)


def selfish_optimum(game, i, profile):
    agent = game.agents[i]
    return enumerated_optimum(
        game,
        [agent.lam if k == i else 0.0 for k in range(len(game.agents))],
        1 - agent.lam,
        [a.effort for a in game.agents],
        {k: plan for k, plan in enumerate(profile or ()) if k != i},
    )


def social_and_potential(game):
    lams = np.array([agent.lam for agent in game.agents])
    works = np.array([agent.effort for agent in game.agents])
    social = enumerated_optimum(game, lams, (1 - lams).sum(), works)
    return social, enumerated_optimum(game, lams / (1 - lams), 1.0, works / (1 - lams))


@pytest.mark.nightly
@pytest.mark.parametrize("motion", first(1, MOTIONS), ids=str)
@pytest.mark.parametrize("solver", ["ENGINE", "HIGHS"])
@pytest.mark.parametrize("make", first(1, [line, crossing]))
def test_best_responses_are_the_least_of_all_enumerated_plans(motion, solver, make):
    game = make(*motion)
    halves = [np.zeros((game.horizon, agent.control_dim)) for agent in game.agents]
    for rows, agent in zip(halves, game.agents, strict=True):
        rows[:2] = (agent.goal - agent.start) / 2
    profile = make_profile(game, halves)
    for i in (0, 1):
        response = best_response(game, i, profile, solver=solver)
        least = selfish_optimum(game, i, profile)
        if np.isinf(least):
            assert response.status is Status.INFEASIBLE
        else:
            assert response.value == pytest.approx(least, **NEAR)
            assert response.bound == pytest.approx(least, **NEAR)


@pytest.mark.nightly
@pytest.mark.parametrize("motion", first(2, MOTIONS), ids=str)
@pytest.mark.parametrize("make", first(1, [line, crossing]))
def test_joint_optima_are_the_least_of_all_enumerated_profiles(motion, make):
    game = make(*motion)
    social, potential = social_and_potential(game)
    assert social_optimum(game).value == pytest.approx(social, **NEAR)
    assert potential_equilibrium(game).value == pytest.approx(potential, **NEAR)


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("motion", MOTIONS, ids=str)
@pytest.mark.parametrize("make", [line, crossing])
def test_joint_optima_of_the_reference_are_the_least_of_all_enumerated_profiles(motion, make):
    game = make(*motion)
    social, _ = social_and_potential(game)
    assert social_optimum(game, solver="HIGHS").value == pytest.approx(social, **NEAR)


@pytest.mark.nightly
@pytest.mark.parametrize("motion", MOTIONS, ids=str)
@pytest.mark.parametrize("until", [None, 3])
@pytest.mark.parametrize("solver", first(1, ["ENGINE", "HIGHS"]))
def test_waiting_for_a_moving_obstacle_is_the_least_of_all_enumerated_plans(motion, until, solver):
    game = sweeper(*motion, until=until)
    response = best_response(game, 0, solver=solver)
    assert response.status is Status.OPTIMAL
    assert response.value == pytest.approx(selfish_optimum(game, 0, None), **NEAR)


def test_each_rule_of_motion_changes_an_optimum_here():
    """The games above would not see a rule that no optimum depends on."""
    values = [social_optimum(crossing(*motion)).value for motion in MOTIONS]
    assert np.diff(np.sort(values)).min() > 0.1
    values = [best_response(sweeper("swept", "stay", until), 0).value for until in (None, 3)]
    assert values[0] > values[1] + 0.1
    game = line("swept", "stay")
    free = replace(game, agents=tuple(replace(agent, effort=0.0) for agent in game.agents))
    assert social_and_potential(free)[0] < social_and_potential(game)[0] - 0.1
