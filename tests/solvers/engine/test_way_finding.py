"""Ways through free space: with no time left nothing is claimed."""

from __future__ import annotations

from ppg_env import Agent, Game, Polytope
from ppg_env.game import objective
from solvers.budget import Budget
from solvers.engine.presolve import Subproblem
from solvers.engine.way_finding import FirstPlans, find_first_plans


def around_a_wall() -> Subproblem:
    """An agent of side 1 that has to go round a wall of height 6 between start and goal."""
    wall = Polytope.from_vertices([[2.5, -3.0], [3.5, -3.0], [3.5, 3.0], [2.5, 3.0]])
    agent = Agent(
        [0.0, 0.0], [6.0, 0.0], Polytope.box([1.0, 1.0]), Polytope.box([2.0, 2.0]), noise=0.0
    )
    game = Game((agent,), (wall,), horizon=30, collisions="swept")
    return Subproblem(objective.social(game), (0,), {})


def test_no_arrival_is_ruled_out_when_the_time_is_over() -> None:
    """A search that has seen nothing must not say that there is no way."""
    assert find_first_plans(around_a_wall(), 6, Budget(0.0)) == FirstPlans(6, None)
