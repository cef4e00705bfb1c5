"""Games of others: each has its right answer, or its right refusal, in Python and on the command
line.

Plans are checked without the project's geometry: shapely moves the bodies along the means and
looks at many points of every step.
"""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely.geometry import MultiPoint, Polygon

from ppg_env import Game, InputError, Profile, make_game, straight_plan
from solvers import Solution, best_response_dynamics, potential_equilibrium, social_optimum
from tests.command import Ppg

GAMES = Path(__file__).parent / "games"
POINTS = 1000
"""Points of every step at which bodies are looked at."""


def load(name: str, **overrides: object) -> Game:
    return make_game(GAMES / f"{name}.toml", **overrides)


def outline(vertices: np.ndarray) -> np.ndarray:
    return np.array(MultiPoint(vertices).convex_hull.exterior.coords)


def deepest_overlap(game: Game, profile: Profile, walls: list[Polygon]) -> float:
    """The largest area shared by two bodies in traffic, at many points of every step."""
    outlines = [outline(agent.shape.vertices) for agent in game.agents]
    share, worst = np.linspace(0.0, 1.0, POINTS + 1)[:, None, None], 0.0
    for t in range(max(plan.arrival or 0 for plan in profile)):
        swept = {
            i: shapely.polygons(
                outlines[i] + (1 - share) * plan.means[t, :2] + share * plan.means[t + 1, :2]
            )
            for i, plan in enumerate(profile)
            if t < plan.arrival or game.on_goal == "stay"
        }
        pairs = [(swept[i], swept[j]) for i, j in combinations(swept, 2)]
        pairs += [(bodies, wall) for bodies in swept.values() for wall in walls]
        for bodies, others in pairs:
            worst = max(worst, float(shapely.area(shapely.intersection(bodies, others)).max()))
    return worst / min(Polygon(corners).area for corners in outlines)


def walls_of(game: Game) -> list[Polygon]:
    return [Polygon(outline(obstacle.vertices_at(0))) for obstacle in game.obstacles]


def assert_solved(solution: Solution, walls: list[Polygon] | None = None) -> None:
    assert solution.profile is not None, solution.advice
    game = solution.game
    assert solution.evaluation.feasible, solution.evaluation.violations()
    walls = walls_of(game) if walls is None else walls
    assert deepest_overlap(game, solution.profile, walls) <= 1e-5


def test_every_file_is_swept() -> None:
    for path in GAMES.glob("*.toml"):
        if path.stem not in ("goalwall", "lshape"):
            assert make_game(path).collisions == "swept"
            assert make_game(path).on_goal == "remove"


def test_a_goal_in_a_wall_is_refused_with_both_names(ppg: Ppg) -> None:
    with pytest.raises(InputError, match=r"agent\[0\]\.goal: .*obstacle\[0\].*agent_0.*; move"):
        load("goalwall")
    run = ppg("solve", GAMES / "goalwall.toml", code=2)
    assert "agent[0].goal: lies 1.5 deep inside obstacle[0]" in " ".join(run.err.split())
    assert run.out == ""


def test_corners_that_are_not_convex_are_refused_with_the_remedy(ppg: Ppg) -> None:
    with pytest.raises(InputError, match=r"obstacle\[0\]\.vertices: .*\[1\.0, 1\.0\].*polygon = "):
        load("lshape")
    assert "polygon = " in ppg("show", GAMES / "lshape.toml", code=2).err


def test_the_remedy_works(tmp_path: Path, ppg: Ppg) -> None:
    text = (GAMES / "lshape.toml").read_text(encoding="utf-8")
    file = tmp_path / "polygon.toml"
    file.write_text(text.replace("vertices = [[0, 0]", "polygon = [[0, 0]"), encoding="utf-8")
    game = make_game(file)
    assert len(game.obstacles) == 2
    corner = Polygon([[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]])
    solution = social_optimum(game, time_limit=60)
    assert_solved(solution, [corner])
    assert solution.evaluation.arrival == (2,)
    assert ppg("solve", file, "--solution", "social", "--json").json["arrival"] == [2]


def test_three_agents_with_one_goal_arrive_one_after_the_other() -> None:
    solution = social_optimum(load("shared"), time_limit=60)
    assert solution.status == "optimal"
    assert_solved(solution)
    assert sorted(solution.evaluation.arrival) == [5, 6, 7]
    equilibrium = best_response_dynamics(load("shared"), time_limit=60)
    assert_solved(equilibrium)
    assert len(set(equilibrium.evaluation.arrival)) == 3


def test_three_agents_cannot_park_on_one_goal(ppg: Ppg) -> None:
    with pytest.raises(InputError, match=r"agent\[1\]\.goal: parks agent_1 on agent_0"):
        load("shared", on_goal="stay")
    run = ppg("solve", GAMES / "shared.toml", "--on-goal", "stay", code=2)
    assert "parks agent_1 on agent_0" in " ".join(run.err.split())


@pytest.mark.parametrize("planner", [best_response_dynamics, social_optimum, potential_equilibrium])
def test_no_plan_in_the_corridor_passes_through_the_other(planner: object) -> None:
    solution = planner(load("swapcor"), time_limit=60)
    if solution.profile is None:
        return
    assert_solved(solution)
    # One waits until the other has arrived, and has left.
    first, second = sorted(solution.evaluation.arrival)
    assert second >= first + 3


@pytest.mark.slow
def test_in_the_corridor_nobody_passes_a_body_that_stays() -> None:
    solution = social_optimum(load("swapcor", on_goal="stay"), node_limit=200)
    assert solution.profile is None


def test_an_agent_at_its_goal_leaves_or_is_in_the_way() -> None:
    solution = social_optimum(load("atgoal"), time_limit=60)
    assert solution.status == "optimal"
    assert_solved(solution)
    assert solution.evaluation.arrival == (10, 0)
    stays = social_optimum(load("atgoal", on_goal="stay"), node_limit=200)
    assert stays.profile is None
    assert stays.status in ("infeasible", "unreachable", "time_limit")


@pytest.mark.parametrize(
    ("planner", "solver"),
    [("nash", "engine"), ("social", "engine"), ("potential", "engine"), ("nash", "highs")],
)
def test_an_agent_that_is_hit_at_its_goal_is_named_with_the_obstacle(
    planner: str, solver: str, ppg: Ppg
) -> None:
    words = ("solve", GAMES / "hitatgoal.toml", "--solution", planner, "--solver", solver)
    run = ppg(*words, "--on-goal", "stay", code=3)
    assert run.out == ""
    said = " ".join(run.err.split())
    assert "agent_0 starts at its goal and stays there, where obstacle 0 hits it; move its" in said


def test_an_agent_that_is_hit_at_its_goal_leaves_or_arrives_later() -> None:
    game = load("hitatgoal")
    leaves = social_optimum(game)
    assert leaves.status == "optimal"
    assert leaves.evaluation.arrival == (0, 5)
    late = {"start": {0: [0.0, -4.0]}, "on_goal": "stay"}
    waits = social_optimum(load("hitatgoal", **late))
    assert waits.status == "optimal"
    assert waits.evaluation.arrival == (6, 5)  # later than the obstacle by a margin
    for planner in (best_response_dynamics, social_optimum, potential_equilibrium):
        refused = planner(load("hitatgoal", **late, horizon=4, control={1: {"box": [3.0, 3.0]}}))
        assert refused.status == "unreachable"
        assert refused.profile is None
        assert "agent_0 cannot arrive within the horizon of 4: obstacle 0 hits" in refused.advice
        assert "set the horizon to 5 or more" in refused.advice


@pytest.mark.parametrize(("name", "arrival"), [("thr3", (8,)), ("os1", (5, 9))])
def test_one_sided_thrusters_reach_their_goals(name: str, arrival: tuple[int, ...]) -> None:
    game = load(name)
    for planner in (best_response_dynamics, social_optimum, potential_equilibrium):
        solution = planner(game, time_limit=60)
        assert_solved(solution)
        assert solution.evaluation.arrival == arrival
    straight = [straight_plan(agent, game.horizon) for agent in game.agents]
    assert tuple(plan.arrival for plan in straight) == arrival


def test_one_sided_thrusters_reach_their_goals_on_the_command_line(ppg: Ppg) -> None:
    report = ppg("solve", GAMES / "os1.toml", "--solution", "best-response", "--json").json
    assert report["arrival"] == [5, 9]
    assert report["status"] == "optimal"


@pytest.mark.slow
def test_the_way_through_the_maze_has_twelve_steps() -> None:
    solution = social_optimum(load("mz2"), time_limit=300)
    assert solution.status == "optimal"
    assert_solved(solution)
    assert solution.evaluation.arrival == (12,)


@pytest.mark.nightly
@pytest.mark.slow
def test_three_cars_merge_at_a_social_cost_of_27() -> None:
    solution = best_response_dynamics(load("merge", collisions="instants"))
    assert solution.status == "equilibrium"
    assert solution.evaluation.feasible
    assert round(solution.evaluation.social_cost, 4) == 27.0
