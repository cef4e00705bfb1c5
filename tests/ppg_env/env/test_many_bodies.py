"""Many bodies: shared tables, and collisions found by sorting or among all pairs alike."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from ppg_env import Game, Polytope, make_game
from ppg_env.env.arrays import Tables
from ppg_env.env.encounter_tables import encounter_kinds, margin_units
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator
from ppg_env.game.margins import encounter_units
from ppg_env.game.obstacle import Obstacle

SHUTTLE = Obstacle(Polytope.box([6, 20]), [[10.0 * t, 0.0] for t in range(8)], noise=0.5, until=12)
WALL = Obstacle(Polytope.from_vertices([[-40.0, -9.0], [-20.0, -9.0], [-20.0, 9.0]]))


def crowd(**changes: Any) -> Game:
    """A crowd of unequal bodies between which obstacles stand and move."""
    game = make_game("circle(9, radius=150)", noise=9.0, obstacles=(SHUTTLE, WALL), **changes)
    shapes = [Polytope.disc(12.0, 5), Polytope.box([30.0, 4.0]), Polytope.l1(9.0)]
    agents = [
        dataclasses.replace(agent, shape=shapes[i % 3], noise=(4.0 + i % 2) * np.eye(2))
        for i, agent in enumerate(game.agents)
    ]
    return dataclasses.replace(game, agents=tuple(agents))


@pytest.mark.parametrize("collisions", ["instants", "swept"])
@pytest.mark.parametrize("on_goal", ["remove", "stay"])
@pytest.mark.parametrize("on_crash", ["remove", "continue"])
def test_sorting_finds_the_collisions_of_all_pairs(
    collisions: str, on_goal: str, on_crash: str
) -> None:
    game = crowd(collisions=collisions, on_goal=on_goal)
    simulators = [Simulator(game, Rules(on_crash=on_crash), copies=40, seed=3) for _ in range(2)]
    simulators[0].tables = simulators[0].tables._replace(sorting=True)
    for simulator in simulators:
        simulator.reset()
    random, met = np.random.default_rng(1), 0
    for _ in range(40):
        goal = simulators[0].tables.goal - simulators[0].state
        action = np.clip(goal, -10, 10) + random.uniform(-4, 4, goal.shape)
        first, second = (simulator.step(action) for simulator in simulators)
        met += int(first.overlap.sum())
        for field in dataclasses.fields(first):
            assert np.array_equal(getattr(first, field.name), getattr(second, field.name))
        assert np.array_equal(simulators[0].bodies, simulators[1].bodies)
    assert met > 100, "the test needs collisions"
    overlap = first.overlap.shape[1]
    assert overlap == 9 * 8 // 2 + 9 * 2


def test_a_position_that_overflowed_meets_every_body_either_way() -> None:
    game, overlaps = make_game("circle(5)"), []
    for many in (True, False):
        simulator = Simulator(game, seed=0)
        if many:
            simulator.tables = simulator.tables._replace(sorting=True)
        simulator.reset()
        simulator.bodies[0, 2] = np.nan
        overlaps.append(simulator.step(np.zeros((1, 5, 2)), restart=False).overlap.copy())
    assert np.array_equal(*overlaps)
    assert overlaps[0].sum() == 4


def test_equal_bodies_share_their_collision_set_and_tables() -> None:
    game = make_game("circle(40)")
    assert len({id(encounter.collision) for encounter in game.encounters}) == 1
    tables = Simulator(game, Rules(reward="margin")).tables
    assert tables.extents.shape == (2, 40, 2)
    assert tables.normals.shape == (4, 2)
    assert tables.units.shape == (3, game.horizon + 1, 4)
    assert Simulator(game).tables.units.size == 0, "no unit is needed for this reward"


def test_kinds_have_the_faces_and_units_of_their_encounters() -> None:
    game = crowd()
    tables: Tables = Simulator(game, Rules(reward="margin")).tables
    kinds, samples = encounter_kinds(game)
    assert len(samples) < len(game.encounters)
    units = margin_units(game)
    for row, kind, encounter in zip(tables.pair, kinds, game.encounters, strict=True):
        rows = slice(*row[2:])
        assert encounter.collision == samples[kind].collision
        assert np.array_equal(tables.normals[rows], encounter.collision.normals)
        assert np.array_equal(tables.offsets[rows], encounter.collision.offsets)
        assert np.array_equal(units[0, :, rows], encounter_units(game, encounter))


@pytest.mark.slow
def test_five_hundred_agents_are_made_and_stepped() -> None:
    game = make_game("circle(500)")
    simulator = Simulator(game, seed=0)
    simulator.reset()
    assert not simulator.step(np.zeros((1, 500, 2))).overlap.any()
    assert simulator.tables.normals.nbytes < 1000
