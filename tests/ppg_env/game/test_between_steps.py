"""Overlaps of means between two time steps: values by hand, and the bounds of a fine sampling."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from ppg_env import Agent, Game, InputError, Polytope, Profile, evaluate, make_profile
from ppg_env.game import Encounter, Obstacle, overlaps_between_steps
from ppg_env.game.between_steps import deepest_point
from tests.marks import first
from tests.profiles import examples

SAMPLES = np.linspace(0.0, 1.0, 1001)


def mover(path: list[list[float]], side: float = 1.0, goal: list[float] | None = None) -> Agent:
    """An agent without noise, bound for the end of ``path``."""
    return Agent(
        start=np.array(path[0]),
        goal=np.array(path[-1] if goal is None else goal),
        shape=Polytope.box([side] * 2),
        control=Polytope.box([40.0] * 2),
        noise=np.zeros((2, 2)),
    )


def profile_on(game: Game, *paths: list[list[float]]) -> Profile:
    """The profile whose means follow ``paths``, one point per step, and stay at their ends."""
    controls = np.zeros((len(paths), game.horizon, 2))
    for rows, path in zip(controls, paths, strict=True):
        rows[: len(path) - 1] = np.diff(path, axis=0)
    return make_profile(game, controls)


SWAP = [[-4.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [4.0, 0.0]]
"""A way past a body that goes the other way, through it in the middle of the second step."""


def swap(**fields: Any) -> tuple[Game, Profile]:
    """Two bodies that swap places on a line."""
    game = Game((mover(SWAP), mover(SWAP[::-1])), horizon=5, **fields)
    return game, profile_on(game, SWAP, SWAP[::-1])


def test_bodies_that_swap_places_pass_through_each_other_half_way() -> None:
    game, profile = swap()
    assert evaluate(game, profile).feasible
    (overlap,) = overlaps_between_steps(game, profile)
    assert overlap.parties == ("agent_0", "agent_1")
    assert (overlap.agents, overlap.obstacle) == ((0, 1), None)
    assert (overlap.step, overlap.moment, overlap.depth) == (1, 0.5, 1.0)
    assert overlap.place == (0.0, 0.0)
    assert str(overlap) == "between steps 1 and 2 the means of agent_0 and agent_1 overlap by 1"


def test_the_swept_rules_refuse_exactly_these_plans() -> None:
    game, profile = swap(collisions="swept")
    assert not evaluate(game, profile).feasible
    aside = [[x, 0.6] for x, _ in SWAP]
    far = [[x, -0.6] for x, _ in SWAP[::-1]]
    game = Game((mover(aside), mover(far)), horizon=5, collisions="swept")
    profile = profile_on(game, aside, far)
    assert evaluate(game, profile).feasible
    assert overlaps_between_steps(game, profile) == ()


def test_a_grazing_corner_has_the_depth_of_its_nearest_face() -> None:
    """The displacement (-1.95, -0.15) + u (3, 3) cuts the corner (-1, 1) of [-1, 1]^2."""
    path, still = [[-3.0, -0.1], [0.0, 2.9]], [[-1.05, 0.05]] * 2
    game = Game((mover(path), mover(still, goal=[9.0, 9.0])), horizon=1)
    (overlap,) = overlaps_between_steps(game, profile_on(game, path, still))
    assert overlap.depth == pytest.approx(0.1)  # the faces x >= -1 and y <= 1 at u = 0.35
    assert overlap.moment == pytest.approx(0.35)


def test_a_touch_is_no_overlap() -> None:
    path, still = [[-3.0, 1.0], [3.0, 1.0]], [[0.0, 0.0]] * 2
    game = Game((mover(path), mover(still, goal=[9.0, 9.0])), horizon=1)
    assert overlaps_between_steps(game, profile_on(game, path, still)) == ()


def test_an_obstacle_thinner_than_a_step_is_passed_through() -> None:
    path = [[-3.0, 0.0], [3.0, 0.0]]
    wall = Polytope.from_vertices([[0.0, -9.0], [0.2, -9.0], [0.2, 9.0], [0.0, 9.0]])
    game = Game((mover(path),), obstacles=(wall,), horizon=3)
    profile = profile_on(game, path)
    assert evaluate(game, profile).feasible
    (overlap,) = overlaps_between_steps(game, profile)
    assert overlap.parties == ("agent_0", "obstacle 0")
    assert (overlap.agents, overlap.obstacle, overlap.step) == ((0,), 0, 0)
    assert overlap.depth == pytest.approx(0.6)  # half of both widths
    assert overlap.place == pytest.approx((0.1, 0.0))


@pytest.mark.parametrize(("until", "count"), [(None, 1), (2, 1), (1, 0)])
def test_a_moving_obstacle_counts_until_it_is_gone(until: int | None, count: int) -> None:
    own, other = [[-4.0, 0.0], [-3.0, 0.0], [3.0, 0.0]], [[4.0, 0.0], [3.0, 0.0], [-3.0, 0.0]]
    body = Obstacle(Polytope.box([1.0, 1.0]), path=np.array(other), until=until)
    game = Game((mover(own),), obstacles=(body,), horizon=4)
    overlaps = overlaps_between_steps(game, profile_on(game, own))
    assert [(o.step, o.moment, o.depth) for o in overlaps] == [(1, 0.5, 1.0)] * count


@pytest.mark.parametrize(("on_goal", "count"), [("remove", 0), ("stay", 1)])
def test_a_parked_body_is_in_the_way_only_where_bodies_stay(on_goal: str, count: int) -> None:
    parked, passing = [[0.0, 0.0], [0.0, 5.0]], [[-9.0, 5.0], [-6.0, 5.0], [6.0, 5.0]]
    game = Game((mover(parked), mover(passing)), horizon=4, on_goal=on_goal)
    overlaps = overlaps_between_steps(game, profile_on(game, parked, passing))
    assert [(o.step, o.depth) for o in overlaps] == [(1, 1.0)] * count


def test_an_arriving_body_counts_up_to_its_arrival() -> None:
    """The end of its last step is no time step in traffic: only the way there shows it."""
    arriving, other = [[0.0, 0.0], [5.0, 0.0]], [[5.0, 4.0], [5.0, 0.25], [5.0, -4.0]]
    game = Game((mover(arriving), mover(other)), horizon=3)
    (overlap,) = overlaps_between_steps(game, profile_on(game, arriving, other))
    assert (overlap.step, overlap.moment, overlap.depth) == (0, 1.0, 0.75)


def test_an_overlap_at_a_time_step_in_traffic_is_not_between_steps() -> None:
    own, still = [[-3.0, 0.0], [0.0, 0.0], [3.0, 0.0]], [[0.5, 0.0]] * 2
    game = Game((mover(own), mover(still, goal=[9.0, 9.0])), horizon=2)
    profile = profile_on(game, own, still)
    assert evaluate(game, profile).residuals.overlap[0] == pytest.approx(0.5)
    assert overlaps_between_steps(game, profile) == ()


def test_the_deepest_comes_first_and_each_encounter_once() -> None:
    """Agent 0 passes two bodies at rest, one of them twice, less deep the second time."""
    path = [[-3.0, 0.0], [3.0, 0.0], [3.0, 0.8], [-3.0, 0.8], [-3.0, 9.0], [3.0, 9.0]]
    bodies = [[0.0, 0.0]] * 2, [[0.0, 8.5]] * 2
    agents = mover(path), *(mover(place, goal=[30.0, 30.0]) for place in bodies)
    game = Game(agents, horizon=5)
    overlaps = overlaps_between_steps(game, profile_on(game, path, *bodies))
    assert [(o.agents, o.step, o.depth) for o in overlaps] == [((0, 1), 0, 1.0), ((0, 2), 4, 0.5)]


@pytest.mark.parametrize("dim", [1, 3])
def test_bodies_on_a_line_and_in_space(dim: int) -> None:
    ends = np.full(dim, -3.0), np.full(dim, 3.0)
    agents = [
        Agent(start=s, goal=g, shape=Polytope.box([2.0] * dim), control=Polytope.box([20.0] * dim))
        for s, g in (ends, ends[::-1])
    ]
    game = Game(tuple(agents), horizon=2)
    controls = np.zeros((2, 2, dim))
    controls[:, 0] = ends[1] - ends[0], ends[0] - ends[1]
    (overlap,) = overlaps_between_steps(game, make_profile(game, controls))
    assert overlap.depth == pytest.approx(2.0)
    assert overlap.place == pytest.approx((0.0,) * dim)


def wander(seed: int, collisions: str, on_goal: str) -> tuple[Game, Profile]:
    """Three polygons on random walks among two obstacles, one of which moves."""
    rng = np.random.default_rng(seed)
    while True:
        paths = rng.uniform(-10, 10, (3, 7, 2))
        agents = tuple(replace(mover(path.tolist()), shape=polygon(rng)) for path in paths)
        obstacles = polygon(rng), Obstacle(polygon(rng), path=rng.uniform(-10, 10, (5, 2)))
        try:
            game = Game(agents, obstacles, horizon=6, collisions=collisions, on_goal=on_goal)
        except InputError:  # bodies that overlap at the start or when parked
            continue
        ends = rng.integers(2, 7, 3)
        ways = [
            [*path[:end].tolist(), path[-1].tolist()] for path, end in zip(paths, ends, strict=True)
        ]
        return game, profile_on(game, *ways)


def polygon(rng: np.random.Generator) -> Polytope:
    """Points on an ellipse, which are in convex position."""
    angles = rng.uniform(0.0, 2 * np.pi, rng.integers(3, 8))
    widths = rng.uniform(1.0, 3.0, 2)
    return Polytope.from_vertices(widths * np.column_stack([np.cos(angles), np.sin(angles)]))


@pytest.mark.parametrize("collisions", first(1, ["swept", "instants"]))
@pytest.mark.parametrize("on_goal", first(1, ["stay", "remove"]))
def test_a_fine_sampling_finds_the_same_depths(collisions: str, on_goal: str) -> None:
    count = 0
    for seed in range(12):
        game, profile = wander(seed, collisions, on_goal)
        reported = {(o.agents, o.obstacle): o for o in overlaps_between_steps(game, profile)}
        for encounter in game.encounters:
            sampled, error = sampled_depth(game, profile, encounter)
            overlap = reported.get((encounter.agents, encounter.obstacle))
            if overlap is None:
                assert sampled <= 1e-6
            else:
                count += 1
                assert sampled - 1e-9 <= overlap.depth <= sampled + error
    assert count > 24


def sampled_depth(game: Game, profile: Profile, encounter: Encounter) -> tuple[float, float]:
    """The largest depth at 1,001 points of every step that counts, and its error."""
    own, other = profile[encounter.agents[0]].means, profile[encounter.agents[-1]].means
    arrivals = [profile[k].arrival for k in encounter.agents]
    ends = [game.horizon + 1 if time is None else time for time in arrivals]
    if encounter.obstacle is not None:
        obstacle = game.obstacles[encounter.obstacle]
        other = obstacle.positions(game.horizon)
        ends += [obstacle.rest] * (game.on_goal == "stay")
    last = max(ends) if game.on_goal == "stay" else min(ends)

    def depth(points: np.ndarray) -> np.ndarray:
        return -encounter.collision.clearance(points)

    best, error = 0.0, 0.0
    for t in range(min(last, game.horizon)):
        first, second = own[t] - other[t], own[t + 1] - other[t + 1]
        if depth(first) > 1e-6 or (t + 1 < last and depth(second) > 1e-6):
            continue
        points = first + SAMPLES[:, None] * (second - first)
        best = max(best, float(depth(points).max()))
        error = max(error, float(np.linalg.norm(second - first)) / 1000)
    return best, error


LINES = st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=1, max_size=9)


@given(LINES)
@examples(2)
def test_the_deepest_point_is_that_of_a_linear_program(lines: list[tuple[int, int]]) -> None:
    first, last = np.array(lines, dtype=float).T
    depth, moment = deepest_point(first, last)
    rows = np.column_stack([-(last - first), np.ones(len(first))])
    program = linprog([0.0, -1.0], A_ub=rows, b_ub=first, bounds=[(0, 1), (None, None)])
    assert depth == pytest.approx(-program.fun, abs=1e-9)
    assert 0 <= moment <= 1
    assert depth == pytest.approx((first + moment * (last - first)).min(), abs=1e-12)
