"""Observations by option: limits, nearest agents, rays, and the full state."""

from __future__ import annotations

import copy
import dataclasses
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test
from shapely.affinity import translate
from shapely.geometry import LineString, Polygon

from ppg_env import Game, InputError, SingleAgentEnv, make_game, path_planning_v0
from ppg_env.env.observers import LIMIT, Lidar, contact, make_observer, ray_directions
from ppg_env.env.simulator import Simulator
from tests.marks import first
from tests.ppg_env.env.test_many_bodies import crowd

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
OPTIONS = ["relative", "box", "neighbours", "neighbours(k=2)", "lidar(rays=5)", "lidar", "state"]


@pytest.mark.parametrize("observation", OPTIONS)
@pytest.mark.parametrize("name", first(1, ["course", "circle(5)", "intersection_3d"]))
def test_official_tests_pass_with_every_option(observation: str, name: str) -> None:
    parallel_api_test(path_planning_v0.parallel_env(name, observation=observation), num_cycles=60)
    parallel_seed_test(lambda: path_planning_v0.parallel_env(name, observation=observation))
    check_env(SingleAgentEnv(name, observation=observation), skip_render_check=True)


@pytest.mark.parametrize("observation", OPTIONS[1:])
def test_observations_stay_within_their_limits(observation: str) -> None:
    env = path_planning_v0.parallel_env(
        crowd(), observation=observation, saturation="none", on_crash="continue", noise=1e6
    )
    observations, _ = env.reset(seed=0)
    space = env.observation_space("agent_0")
    assert np.isfinite([space.low, space.high]).all()
    largest = 0.0
    for _ in range(6):
        for agent, entries in observations.items():
            assert env.observation_space(agent).contains(entries)
            largest = max(largest, float(np.abs(entries).max()))
        observations = env.step({agent: np.full(2, 500.0) for agent in env.agents})[0]
    assert largest == LIMIT, "the limits must have been reached"


def test_the_usual_observations_are_the_default_and_box_cuts_them_off() -> None:
    usual, same, box = (
        path_planning_v0.parallel_env("circle(4)", **options).reset(seed=2)[0]
        for options in ({}, {"observation": "relative"}, {"observation": "box"})
    )
    for agent, entries in usual.items():
        assert np.array_equal(entries, same[agent])
        assert np.array_equal(entries, box[agent]), "nothing to cut off in this field"


@pytest.mark.parametrize("count", [1, 3, 20])
@pytest.mark.parametrize("agents", [1, 3, 40])
def test_neighbours_are_the_nearest_that_are_present(count: int, agents: int) -> None:
    simulator = Simulator(make_game(f"circle({agents})"), copies=3, seed=1)
    simulator.reset()
    simulator.bodies += np.random.default_rng(0).normal(0, 50, simulator.bodies.shape)
    simulator.status[:, ::3] = 2
    simulator.step(np.zeros((3, agents, 2)), restart=False)
    observed = make_observer(simulator, f"neighbours({count})").read(simulator.last.observation)
    assert observed.shape == (3, agents, 6 + 3 * count)
    scale = simulator.tables.scale
    for c in range(3):
        for i in range(agents):
            others = [j for j in range(agents) if j != i and simulator.status[c, j] == 0]
            away = [simulator.state[c, j] - simulator.state[c, i] for j in others]
            away.sort(key=np.linalg.norm)
            wanted = np.zeros((count, 3))
            for k, place in enumerate(away[:count]):
                wanted[k] = [1.0, *np.clip(place / scale, -LIMIT, LIMIT)]
            np.testing.assert_allclose(observed[c, i, 6:].reshape(count, 3), wanted, atol=1e-5)


@pytest.mark.parametrize("on_goal", ["remove", "stay"])
def test_rays_end_where_bodies_touch(on_goal: str) -> None:
    """Against shapely: the segment from the agent's place to the boundary of the collision set."""
    game = crowd(on_goal=on_goal)
    simulator = Simulator(game, copies=4, seed=3)
    simulator.reset()
    simulator.bodies[:, :9] = np.random.default_rng(1).uniform(-70, 70, (4, 9, 2))
    simulator.status[:, :3] = [1, 2, 0]
    simulator.clock[3] = 12  # the shuttle is gone
    rays = Lidar(simulator, 7)
    distances = rays.distances()
    for c in range(4):
        for i in range(9):
            sets = list(collision_polygons(game, simulator, c, i))
            for r, u in enumerate(rays.directions):
                start = simulator.state[c, i]
                ray = LineString([start, start + 1000 * u])
                hits = [body.intersection(ray) for body in sets]
                from_start = LineString([start, start + 1e-9 * u])
                wanted = min(
                    (hit.distance(from_start) for hit in hits if not hit.is_empty), default=np.inf
                )
                assert distances[c, i, r] == pytest.approx(wanted, abs=1e-6)
    assert np.isinf(distances).any()
    assert (distances == 0).any()


def collision_polygons(game: Game, simulator: Simulator, c: int, i: int) -> Any:
    """Yield what a point at agent i's place must not enter, in copy c."""
    for encounter in game.encounters:
        polygon = Polygon(encounter.collision.vertices)
        if encounter.obstacle is not None:
            if encounter.agents != (i,):
                continue
            if game.obstacles[encounter.obstacle].path is None:
                yield polygon
            elif simulator.clock[c] < 12:
                yield translate(polygon, *simulator.bodies[c, 9])
            continue
        if i not in encounter.agents:
            continue
        (j,) = set(encounter.agents) - {i}
        stays = game.on_goal == "stay" and simulator.status[c, j] == 1
        if simulator.status[c, j] == 0 or stays:
            mirrored = encounter.collision.vertices * (1 if i < j else -1)
            yield translate(Polygon(mirrored), *simulator.state[c, j])


def test_rays_are_unit_vectors_in_every_dimension() -> None:
    for dim, count in ((1, 2), (2, 16), (3, 16)):
        directions = ray_directions(dim, 16)
        assert directions.shape == (count, dim)
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
        np.testing.assert_allclose(directions.mean(axis=0), 0.0, atol=0.05)


def test_a_ray_along_a_face_misses_what_is_next_to_it() -> None:
    normals = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    for start, wanted in (([-5.0, 0.5], 4.0), ([-5.0, 2.0], np.inf), ([0.0, 0.0], 0.0)):
        room = np.ones(4) - normals @ np.array(start)
        assert contact(room, normals @ np.array([1.0, 0.0])) == wanted


def test_the_full_state_is_that_of_the_environment() -> None:
    env = path_planning_v0.parallel_env(crowd(), observation="state")
    observations, _ = env.reset(seed=0)
    for _ in range(3):
        for i, agent in enumerate(observations):
            np.testing.assert_array_equal(observations[agent][:-9], env.state())
            np.testing.assert_array_equal(observations[agent][-9:], np.eye(9)[i])
        observations = env.step({agent: np.ones(2) for agent in env.agents})[0]


@pytest.mark.parametrize(
    "observation", ["pixels", "box(3)", "neighbours(0)", "neighbours(rays=3)", "lidar(k=3)",
                    "lidar(1000)", "lidar(", "state()", ""],
)  # fmt: skip
def test_wrong_options_are_refused(observation: str) -> None:
    with pytest.raises(InputError, match="observation"):
        path_planning_v0.parallel_env("head_on", observation=observation)


def test_agents_have_the_names_of_the_game() -> None:
    game = make_game("head_on")
    named = [dataclasses.replace(game.agents[0], name="ferry"), game.agents[1]]
    env = path_planning_v0.parallel_env(dataclasses.replace(game, agents=tuple(named)))
    assert env.possible_agents == ["ferry", "agent_1"]
    parallel_api_test(env, num_cycles=30)


def test_the_generator_is_that_of_the_noise() -> None:
    env = path_planning_v0.parallel_env("head_on")
    env.reset(seed=5)
    twin = copy.deepcopy(env)
    assert twin.np_random.standard_normal() == env.np_random.standard_normal()
