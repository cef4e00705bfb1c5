from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import Agent, Game, InputError, Polytope, make_game
from ppg_env.game.polytope import collision_set

SHAPE, CONTROL = Polytope.box([2.0, 2.0]), Polytope.box([2.0, 2.0])


def agent(x: float = 0.0, **fields: object) -> Agent:
    return Agent(
        **{"start": [x, 0.0], "goal": [x, 9.0], "shape": SHAPE, "control": CONTROL} | fields
    )


def test_encounters_are_all_pairs_and_then_each_agent_with_each_obstacle() -> None:
    wall = Polytope.from_vertices([[0, 50], [1, 50], [0, 51]])
    game = Game((agent(0), agent(5), agent(10)), (wall, wall))
    found = [(encounter.agents, encounter.obstacle) for encounter in game.encounters]
    pairs = [((0, 1), None), ((0, 2), None), ((1, 2), None)]
    assert found == pairs + [((i,), k) for i in range(3) for k in range(2)]
    assert game.encounters[0].collision == collision_set(SHAPE, SHAPE)
    assert game.encounters[3].collision == collision_set(SHAPE, wall)


def test_bodies_may_touch_at_the_start_but_not_overlap() -> None:
    assert Game((agent(0), agent(2))).horizon == 15
    with pytest.raises(InputError, match=r"agent\[0\]\.start: overlaps agent\[1\]"):
        Game((agent(0), agent(1.9)))
    with pytest.raises(InputError, match=r"agent\[0\]\.start: overlaps obstacle\[0\]"):
        Game((agent(0),), (Polytope.from_vertices([[0, 0], [5, 0], [0, 5]]),))


def test_agents_are_named_by_their_place_unless_named() -> None:
    assert Game((agent(0), agent(5, name="anna"))).agent_names == ("agent_0", "anna")
    with pytest.raises(InputError, match="twice"):
        Game((agent(0, name="anna"), agent(5, name="anna")))
    with pytest.raises(InputError, match="twice"):
        Game((agent(0), agent(5, name="agent_0")))


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"agents": ()}, "agent"),
        ({"horizon": 0}, "horizon"),
        ({"horizon": 2.5}, "horizon"),
        ({"horizon": True}, "horizon"),
        ({"horizon": 10_001}, "horizon"),
        ({"objective": "safety"}, "objective"),
        ({"objective": None}, "objective"),
        ({"margin_cap": 0}, "margin_cap"),
        ({"margin_cap": 27}, "margin_cap"),
        ({"margin_cap": float("nan")}, "margin_cap"),
        ({"crash_cost": -1}, "crash_cost"),
        ({"crash_cost": "much"}, "crash_cost"),
        ({"crash_cost": 10**400}, "crash_cost"),
        ({"scale": "inexact"}, "scale"),
        ({"name": 5}, "name"),
        ({"agents": ("anna",)}, "agent"),
        ({"obstacles": ("wall",)}, "obstacle"),
        ({"obstacles": (Polytope.box([1.0, 1.0, 1.0]),)}, r"obstacle\[0\]"),
    ],
    ids=lambda value: str(value)[:50],
)
def test_each_field_of_a_game_is_checked(fields: dict[str, object], place: str) -> None:
    with pytest.raises(InputError, match=f"^{place}"):
        Game(**{"agents": (agent(),)} | fields)


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"start": []}, "start"),
        ({"start": 3.0}, "start"),
        ({"start": [[0.0, 0.0]]}, "start"),
        ({"start": ["0", "1"]}, "start"),
        ({"start": [True, False]}, "start"),
        ({"start": [0.0, float("inf")]}, "start"),
        ({"start": [0.0, 10**400]}, "start"),
        ({"start": None}, "start"),
        ({"goal": [1.0]}, "goal"),
        ({"goal": [1.0, 2.0, 3.0]}, "goal"),
        ({"goal": [1.0, float("nan")]}, "goal"),
        ({"shape": "box"}, "shape"),
        ({"shape": Polytope.box([1.0, 1.0, 1.0])}, "shape"),
        ({"control": None}, "control"),
        ({"control": Polytope.box([1.0])}, "control"),
        ({"lam": 1.0}, "lam"),
        ({"lam": -0.1}, "lam"),
        ({"lam": "0.5"}, "lam"),
        ({"lam": float("nan")}, "lam"),
        ({"lam": True}, "lam"),
        ({"gain": [[0.5]]}, "gain"),
        ({"gain": "0.5"}, "gain"),
        ({"gain": float("inf")}, "gain"),
        ({"noise": [[1.0, 0.5], [0.4, 1.0]]}, "noise"),
        ({"noise": [[1.0, 2.0], [2.0, 1.0]]}, "noise"),
        ({"noise": -1.0}, "noise"),
        ({"noise": [1.0, 1.0]}, "noise"),
        ({"sigma0": [[0.0, 1.0], [1.0, 0.0]]}, "sigma0"),
        ({"A": np.eye(3)}, "A"),
        ({"A": 1.0}, "A"),
        ({"B": [[1.0, 0.0]]}, "B"),
        ({"B": [["x", 0.0], [0.0, 1.0]]}, "B"),
        ({"name": ""}, "name"),
        ({"name": " "}, "name"),
        ({"name": 7}, "name"),
    ],
    ids=lambda value: str(value)[:50],
)
def test_each_field_of_an_agent_is_checked(fields: dict[str, object], place: str) -> None:
    with pytest.raises(InputError, match=f"^{place}") as caught:
        agent(**fields)
    assert "\n" not in str(caught.value)


def test_covariances_may_be_singular() -> None:
    made = agent(noise=[[1.0, 1.0], [1.0, 1.0]], sigma0=[[0.0, 0.0], [0.0, 2.0]])
    assert np.linalg.matrix_rank(np.asarray(made.noise)) == 1


def test_agents_must_share_one_space() -> None:
    flat = Agent([0.0], [5.0], Polytope.box([1.0]), Polytope.box([1.0]))
    with pytest.raises(InputError, match=r"agent\[1\]\.shape"):
        Game((agent(), flat))


def test_bodies_without_volume_cannot_meet() -> None:
    point = Polytope.box([0.0, 0.0])
    assert Game((agent(shape=point),)).encounters == ()
    with pytest.raises(InputError, match=r"agent\[1\]\.shape"):
        Game((agent(0, shape=point), agent(5, shape=point)))


def test_replace_checks_again() -> None:
    with pytest.raises(InputError, match="lam"):
        replace(agent(), lam=1.5)
    assert replace(agent(), lam=0.25).lam == 0.25


def test_the_spectral_radius_is_that_of_the_closed_loop() -> None:
    made = agent(gain=[[0.5, 1.0], [0.0, 0.75]])
    assert made.spectral_radius == pytest.approx(0.5)
    np.testing.assert_array_equal(made.closed_loop, [[0.5, -1.0], [0.0, 0.25]])


def test_the_defaults_are_those_of_the_design() -> None:
    game = make_game("head_on")
    assert (game.horizon, game.margin_cap, game.objective) == (15, 3.0, "margin")
    for mover in game.agents:
        assert mover.lam == 0.5
        np.testing.assert_array_equal(mover.noise, 1.9 * np.eye(2))
        np.testing.assert_array_equal(mover.gain, 0.5 * np.eye(2))
        assert mover.shape == Polytope.box([15.0, 15.0])
        assert mover.control == Polytope.box([20.0, 20.0])
