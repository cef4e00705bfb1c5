from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from ppg_env import Game, Plan, Polytope, make_game, make_plan
from ppg_env.support.frozen import frozen_array
from tests.ppg_env.strategies import games
from tests.profiles import examples


@examples(0.25)
@given(games())
def test_copies_are_equal_and_hash_alike(game: Game) -> None:
    for other in (copy.copy(game), copy.deepcopy(game), pickle.loads(pickle.dumps(game))):
        assert other == game
        assert hash(other) == hash(game)
        assert {game: "found"}[other] == "found"


def test_every_scenario_equals_itself_made_again_and_no_other(game: Game) -> None:
    again = replace(game)
    assert again is not game
    assert again == game
    assert hash(again) == hash(game)
    assert replace(game, horizon=game.horizon + 1) != game


@pytest.mark.parametrize(
    "change",
    [
        {"lam": 0.51},
        {"gain": 0.4},
        {"noise": 1.8},
        {"start": [10.0, 50.5]},
        {"goal": [95.0, 50.5]},
        {"shape": Polytope.box([15.0, 14.0])},
        {"control": Polytope.l1(10.0)},
        {"A": [[1.0, 0.1], [0.0, 1.0]]},
        {"B": [[2.0, 0.0], [0.0, 1.0]]},
        {"sigma0": 0.1},
        {"name": "anna"},
    ],
    ids=lambda change: next(iter(change)),
)
def test_each_field_of_an_agent_tells_two_games_apart(change: dict[str, object]) -> None:
    game = make_game("head_on")
    changed = replace(game, agents=(replace(game.agents[0], **change), game.agents[1]))
    assert changed != game
    assert len({changed, game}) == 2


def test_the_way_a_polytope_was_written_counts() -> None:
    box = Polytope.box([2.0, 2.0])
    assert box != Polytope.from_vertices(box.vertices)
    assert Polytope.disc(10.0, 16) == Polytope.disc(10.0)
    assert Polytope.disc(10.0, 8) != Polytope.disc(10.0)
    assert Polytope.l1(1.0, 2) != Polytope.l1(1.0, 3)


def test_records_of_different_classes_are_not_equal() -> None:
    game = make_game("head_on")
    assert game != game.agents[0]
    assert game.agents[0].shape != "box"


def test_minus_zero_is_zero() -> None:
    one, other = (
        Polytope.from_vertices([[-0.0, 0.0], [1, 0], [0, 1]]),
        [[0.0, -0.0], [1, 0], [0, 1]],
    )
    assert one == Polytope.from_vertices(other)
    assert hash(one) == hash(Polytope.from_vertices(other))


def arrays_of(game: Game) -> dict[str, np.ndarray]:
    agent, shape = game.agents[0], game.agents[0].shape
    names = ("start", "goal", "gain", "noise", "A", "B", "sigma0")
    return {name: getattr(agent, name) for name in names} | {
        "params": shape.params[0],
        "vertices": shape.vertices,
        "normals": shape.normals,
        "offsets": shape.offsets,
        "collision": game.encounters[0].collision.vertices,
    }


@pytest.mark.parametrize(
    "how", [lambda g: g, copy.deepcopy, lambda g: pickle.loads(pickle.dumps(g))]
)
def test_arrays_are_read_only_and_stay_so_in_copies(how: object) -> None:
    game = how(make_game("head_on"))  # type: ignore[operator]
    for name, array in arrays_of(game).items():
        assert not array.flags.writeable, name
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_fields_cannot_be_set() -> None:
    game = make_game("head_on")
    with pytest.raises(AttributeError):
        game.horizon = 3  # type: ignore[misc]
    with pytest.raises(AttributeError):
        game.agents[0].lam = 0.1  # type: ignore[misc]


def test_the_callers_array_is_copied() -> None:
    mine = np.array([1.0, 2.0])
    kept = frozen_array(mine)
    mine[0] = 5.0
    assert kept.tolist() == [1.0, 2.0]
    assert mine.flags.writeable


def test_plans_are_values_too() -> None:
    agent = make_game("head_on").agents[0]
    controls = np.tile([10.0, 0.0], (15, 1))
    plan = make_plan(agent, controls)
    assert plan == make_plan(agent, controls)
    assert plan == pickle.loads(pickle.dumps(plan)) == copy.deepcopy(plan)
    assert plan != make_plan(agent, controls * 0.5)
    assert not plan.means.flags.writeable
    assert isinstance(hash(plan), int)
    assert isinstance(plan, Plan)
