"""Walls, alcoves and wells: refusals with names, and equilibria where bodies keep apart in motion.

Bodies stay at their goals, and the line between two time steps counts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import Agent, Game, InputError, Polytope, evaluate
from solvers import (
    best_response,
    best_response_dynamics,
    certify,
    potential_equilibrium,
    social_optimum,
)
from solvers.equilibrium.enumeration import passing
from solvers.equilibrium.start_profile import WAITING, absent_plan, start_profile
from solvers.liability import make_rule
from solvers.solution import Status


def block(left, low, right, high):
    return Polytope.from_vertices([[left, low], [right, low], [right, high], [left, high]])


def mover(start, goal, shape, control, **fields):
    fields = {"noise": 0.0, "gain": 0.5, "lam": 0.8} | fields
    return Agent(start=start, goal=goal, shape=shape, control=control, **fields)


def flown(agents, walls, horizon):
    return Game(
        agents, walls, horizon=horizon, objective="risk", collisions="swept", on_goal="stay"
    )


def maze() -> Game:
    """One body in a maze of lanes one body wide; the shortest plan has 12 steps."""
    cells = [(1, 0), (1, 1), (3, 1), (1, 2), (3, 2), (1, 3), (3, 3), (1, 4), (3, 4), (3, 5), (0, 6)]
    walls = [block(x - 0.5, y - 0.5, x + 0.5, y + 0.5) for x, y in cells]
    walls += [block(3.5, 0.5, 5.5, 1.5), block(4.5, 2.5, 6.5, 3.5), block(3.5, 4.5, 5.5, 5.5)]
    walls += [block(0.5, 5.5, 1.5, 6.5)]
    walls += [block(-1.5, -1.5, -0.5, 7.5), block(6.5, -1.5, 7.5, 7.5)]
    walls += [block(-0.5, -1.5, 6.5, -0.5), block(-0.5, 6.5, 6.5, 7.5)]
    agent = mover([0.0, 0.0], [2.0, 0.0], Polytope.box([0.9, 0.9]), Polytope.l1(1.0))
    return flown((agent,), walls, 16)


def well() -> Game:
    """A dead end below a corridor: one body has to come out before the other can enter."""
    walls = [block(-0.5, 2, 6.5, 2.5), block(-0.5, 0.5, 2.5, 1), block(3.5, 0.5, 6.5, 1)]
    walls += [block(-0.5, 1, 0, 2), block(6, 1, 6.5, 2), block(2, -1.5, 2.5, 1)]
    walls += [block(3.5, -1.5, 4, 1), block(2, -1.5, 4, -1)]
    shape, control = Polytope.box([0.6, 0.6]), Polytope.l1(0.5)
    enters = mover([0.5, 1.5], [3.0, -0.5], shape, control)
    leaves = mover([3.0, -0.5], [0.5, 1.5], shape, control)
    return flown((enters, leaves), walls, 30)


def corridor(*agents: Agent) -> Game:
    """A corridor one lane wide, closed at both ends."""
    walls = [block(-10, 0.5, 10, 3), block(-10, -3, 10, -0.5)]
    return flown(agents, [*walls, block(-11, -3, -10, 3), block(10, -3, 11, 3)], 15)


def lane(start, goal, **fields) -> Agent:
    shape, control = Polytope.box([0.98, 0.98]), Polytope.box([6.0, 6.0])
    return mover([start, 0.0], [goal, 0.0], shape, control, **fields)


def sealed() -> Game:
    walls = [block(-5, 4.5, 5, 5), block(-5, -5, 5, -4.5)]
    walls += [block(-5, -5, -4.5, 5), block(4.5, -5, 5, 5)]
    shape, control = Polytope.box([1.0, 1.0]), Polytope.box([6.0, 6.0])
    return flown((mover([0.0, 0.0], [12.0, 0.0], shape, control, name="ann"),), walls, 15)


@pytest.mark.parametrize(
    "plan",
    [
        lambda game: best_response(game, 0),
        best_response_dynamics,
        potential_equilibrium,
        social_optimum,
        lambda game: best_response_dynamics(game, charge="pigou"),
        lambda game: best_response_dynamics(game, charge="right-of-way"),
    ],
)
def test_a_sealed_room_is_refused_with_the_agents_name(plan):
    solution = plan(sealed())
    assert solution.status is Status.UNREACHABLE
    assert solution.profile is None
    assert solution.advice.startswith("ann cannot reach its goal: ")


def test_no_plan_out_of_a_sealed_room_is_certified():
    from ppg_env import make_profile

    game = sealed()
    with pytest.raises(InputError, match="ann"):
        certify(game, make_profile(game, [np.tile([3.0, 0.0], (15, 1))]))


def test_a_horizon_that_is_too_short_for_the_way_around_is_named():
    game = replace(maze(), horizon=11)
    solution = social_optimum(game)
    assert solution.status is Status.UNREACHABLE
    assert "within the horizon of 11; set the horizon to 12 or more" in solution.advice


def wall(height: float, speed: float) -> Game:
    """A thin wall between a body and its goal, with ways around both ends."""
    shape, control = Polytope.box([1.0, 1.0]), Polytope.box([2 * speed, 2 * speed])
    agent = mover([0.0, 0.0], [4.0, 0.0], shape, control, name="ann")
    return flown((agent,), [block(2.0, -height, 2.001, height)], 10)


def test_a_way_around_that_is_very_long_is_not_called_closed():
    solution = best_response(wall(50.0, 1.0), 0)
    assert solution.status is Status.UNREACHABLE
    assert "nor within one of 100" in solution.advice
    assert "raise the horizon further" in solution.advice


def test_advice_names_a_horizon_above_that_of_the_game_and_not_above_what_is_needed():
    """Fast agents have coarse cells, which show no way of the horizon as too short."""
    game = wall(50.0, 9.0)
    advice = best_response(game, 0).advice
    assert "around the obstacles within the horizon of 10; set the horizon to 12 or more" in advice
    assert best_response(replace(game, horizon=20), 0).evaluation.arrival == (13,)


def test_controls_that_lead_away_are_not_called_slow():
    backwards = Polytope.from_vertices([[0.0, 0.0], [-1.0, 1.0], [-1.0, -1.0]])
    agent = mover([0.0, 0.0], [4.0, 0.0], Polytope.box([1.0, 1.0]), backwards, name="ann")
    advice = best_response(flown((agent,), [], 10), 0).advice
    assert "others that lead to the goal" in advice
    assert "speed" not in advice


def test_a_room_is_called_closed_at_any_horizon():
    assert "every way is closed by obstacles; open" in best_response(sealed(), 0).advice


def test_the_way_through_a_maze_is_found_and_proved_at_once():
    solution = best_response(maze(), 0)
    assert solution.status is Status.OPTIMAL
    assert solution.evaluation.arrival == (12,)
    assert solution.evaluation.violations() == ()


def test_an_agent_that_stays_at_its_start_closes_a_corridor():
    game = corridor(lane(-4.0, 4.0), lane(0.0, 0.0, name="bob"))
    for solution in (best_response_dynamics(game), social_optimum(game)):
        assert solution.status is Status.UNREACHABLE
        assert "bob" in solution.advice
    leaves = replace(game, on_goal="remove")
    assert social_optimum(leaves).status is Status.OPTIMAL


def test_no_response_passes_a_body_that_comes_through_a_corridor():
    game = corridor(lane(-4.0, 4.0), lane(4.0, -4.0))
    profile, _ = start_profile(make_rule(game, "selfish"), "straight")
    response = best_response(game, 0, profile)
    assert response.status is Status.INFEASIBLE
    assert response.bound == np.inf


@pytest.mark.slow
def test_a_body_leaves_a_well_before_the_other_enters():
    game = well()
    solution = best_response_dynamics(game)
    assert solution.status is Status.EQUILIBRIUM
    assert solution.evaluation.violations() == ()
    assert certify(game, solution.profile).epsilon <= 1e-5


def test_absent_agents_stand_in_nobodys_way_and_waiting_ones_do():  # codespell:ignore nobodys
    game = corridor(lane(-4.0, 4.0), lane(0.0, 8.0))
    rule = make_rule(game, "selfish")
    for start, free in (("sequential", True), (WAITING, False)):
        profile, pending = start_profile(rule, start)
        assert pending == {0, 1}
        response = best_response(game, 0, profile)
        assert (response.profile is not None) == free


def test_an_absent_agent_costs_nothing_where_bodies_stay():
    game = replace(corridor(lane(-4.0, 4.0), lane(0.0, 8.0)), obstacles=())
    noisy = replace(game, agents=tuple(replace(a, noise=0.01) for a in game.agents))
    plans, _ = start_profile(make_rule(noisy, "selfish"), "straight")
    judged = evaluate(noisy, (plans[0], absent_plan(noisy, 1)), as_given=True)
    assert judged.margins.min() == noisy.margin_cap


def test_agents_that_start_at_their_goals_are_never_absent_or_waiting():
    game = corridor(lane(-4.0, -2.0), lane(0.0, 0.0))
    for start in ("sequential", WAITING):
        plans, pending = start_profile(make_rule(game, "selfish"), start)
        assert pending == {0}
        assert plans[1].arrival == 0


def test_passing_counts_until_the_last_agent_has_arrived_where_bodies_stay():
    shape, control = Polytope.box([0.5, 0.5]), Polytope.box([4.0, 4.0])
    slow, control_slow = [-6.0, 1.0], Polytope.box([2.0, 2.0])
    agents = (
        mover([0.0, -2.0], [0.0, 0.0], shape, control),
        mover(slow, [6.0, 1.0], shape, control_slow),
    )
    game = flown(agents, (), 15)
    solution = best_response_dynamics(game)
    assert solution.evaluation.arrival[0] < solution.evaluation.arrival[1]
    assert passing(game, solution.profile) != passing(
        replace(game, on_goal="remove"), solution.profile
    )
    assert passing(game, solution.profile).startswith("0<1")


@pytest.mark.slow
def test_two_bodies_change_ends_of_a_corridor_with_an_alcove():
    walls = [block(0, 0, 1.5, 0.5), block(2.5, 0, 4, 0.5), block(-0.6, -0.6, 0, 2.1)]
    walls += [block(4, -0.6, 4.6, 2.1), block(-0.6, -0.6, 4.6, 0), block(-0.6, 1.5, 4.6, 2.1)]
    shape, control = Polytope.disc(0.3, 8), Polytope.disc(0.25, 8)
    ends = ([0.5, 1.0], [3.5, 1.0])
    agents = [mover(*way, shape, control, lam=0.9) for way in (ends, ends[::-1])]
    for on_goal in ("stay", "remove"):
        game = replace(flown(agents, walls, 30), on_goal=on_goal)
        solution = best_response_dynamics(game)
        assert solution.status is Status.EQUILIBRIUM
        assert sorted(solution.evaluation.arrival) == [13, 14]
        assert certify(game, solution.profile).epsilon <= 1e-5
