from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from ppg_env import Agent, Game, InputError, Polytope, make_game
from ppg_env.formats.game_file import game_from_tables, game_to_tables, game_to_toml, read_game
from tests.ppg_env.strategies import double_integrator, games
from tests.profiles import examples

MINIMAL = """
[[agent]]
start = [10.0, 50.0]
goal = [95.0, 50.0]
shape = { box = [15.0, 15.0] }
control = { box = [10.0, 10.0] }
"""


def parse(text: str) -> Game:
    return game_from_tables(tomllib.loads(text), "text")


def test_every_scenario_survives_a_file_exactly(game: Game, tmp_path: Path) -> None:
    path = tmp_path / "game.toml"
    path.write_text(game_to_toml(game), encoding="utf-8")
    again = read_game(path)
    assert again == game
    assert hash(again) == hash(game)
    assert game_to_toml(again) == game_to_toml(game)


@examples(0.5)
@given(games())
def test_any_game_survives_a_file_exactly(game: Game) -> None:
    assert parse(game_to_toml(game)) == game


@pytest.mark.parametrize("shape", [Polytope.disc(7.0), Polytope.l1(7.0), Polytope.disc(7.0, 5)])
def test_a_body_or_obstacle_made_as_disc_or_l1_ball_survives_a_file(shape: Polytope) -> None:
    game = make_game("head_on", shape=shape, obstacles=(shape,))
    assert parse(game_to_toml(game)) == game


@examples(0.25)
@given(games())
def test_tables_hold_only_what_json_and_toml_know(game: Game) -> None:
    def walk(value: object) -> None:
        if isinstance(value, dict):
            assert all(isinstance(key, str) for key in value)
            for item in value.values():
                walk(item)
        elif isinstance(value, list):
            for item in value:
                walk(item)
        else:
            assert type(value) in (int, float, str)

    walk(game_to_tables(game))


def test_what_a_file_leaves_out_has_the_documented_default() -> None:
    game = parse(MINIMAL)
    (agent,) = game.agents
    assert (game.horizon, game.margin_cap, game.objective) == (15, 3.0, "margin")
    assert (game.crash_cost, game.scale, game.obstacles) == (100.0, "exact", ())
    assert agent.lam == 0.5
    np.testing.assert_array_equal(agent.noise, 1.9 * np.eye(2))
    np.testing.assert_array_equal(agent.sigma0, np.zeros((2, 2)))
    np.testing.assert_array_equal(agent.A, np.eye(2))
    np.testing.assert_array_equal(agent.B, np.eye(2))
    np.testing.assert_array_equal(agent.gain, np.zeros((2, 2)))
    assert agent.name is None
    assert game.agent_names == ("agent_0",)


@pytest.mark.parametrize(("objective", "cap"), [("margin", 3.0), ("risk", 5.0)])
def test_each_objective_has_its_own_cap(objective: str, cap: float) -> None:
    assert parse(f'[game]\nobjective = "{objective}"\n{MINIMAL}').margin_cap == cap
    given = parse(f'[game]\nobjective = "{objective}"\nmargin_cap = 4.0\n{MINIMAL}')
    assert given.margin_cap == 4.0


def test_the_file_of_the_design_is_the_scenario_head_on_with_a_wall() -> None:
    text = """
    [game]
    horizon = 15
    margin_cap = 3.0
    objective = "margin"            # or "risk"
    crash_cost = 100.0
    [[agent]]
    start = [10.0, 50.0]
    goal = [95.0, 50.0]
    lam = 0.5
    gain = 0.5                      # number or matrix
    shape = { box = [15.0, 15.0] }
    control = { box = [10.0, 10.0] }
    noise = [[1.9, 0.0], [0.0, 1.9]]
    [[obstacle]]
    vertices = [[40.0, 0.0], [50.0, 0.0], [50.0, 20.0], [40.0, 20.0]]
    """
    game = parse(text)
    assert game.agents[0] == make_game("head_on").agents[0]
    (wall,) = game.obstacles
    assert sorted(wall.shape.vertices.tolist()) == [[40, 0], [40, 20], [50, 0], [50, 20]]


def test_a_control_box_holds_largest_values_and_a_shape_box_full_lengths() -> None:
    agent = parse(MINIMAL).agents[0]
    assert np.abs(agent.control.vertices).max() == 10.0
    assert np.abs(agent.shape.vertices).max() == 7.5


@pytest.mark.parametrize(
    ("control", "expected"),
    [
        ("{ box = [1.0, 2.0] }", Polytope.box([2.0, 4.0])),
        ("{ l1 = 10.0 }", Polytope.l1(10.0)),
        ("{ disc = 10.0, sides = 8 }", Polytope.disc(10.0, 8)),
        ("{ disc = 10 }", Polytope.disc(10.0, 16)),
        ("{ vertices = [[1, 0], [0, 1], [-1, -1]] }", [[1, 0], [0, 1], [-1, -1]]),
    ],
)
def test_each_control_set_of_the_design_is_read(control: str, expected: object) -> None:
    found = parse(MINIMAL.replace("{ box = [10.0, 10.0] }", control)).agents[0].control
    made = expected if isinstance(expected, Polytope) else Polytope.from_vertices(expected)
    assert found == made


def test_halfplanes_are_read_as_bodies() -> None:
    half = "{ normals = [[1, 0], [-1, 0], [0, 1], [0, -1]], offsets = [1, 2, 3, 4] }"
    shape = parse(MINIMAL.replace("{ box = [15.0, 15.0] }", half)).agents[0].shape
    assert sorted(shape.vertices.round(9).tolist()) == [[-2, -4], [-2, 3], [1, -4], [1, 3]]


def test_a_double_integrator_with_four_states_and_two_inputs_survives_a_file() -> None:
    A, B = double_integrator(2)
    for goal in ([9.0, 9.0], [9.0, 9.0, 0.0, 0.0]):
        agent = Agent(
            [0, 0, 1, 0], goal, Polytope.box([2, 2]), Polytope.l1(3.0), gain=np.full((2, 4), 0.25),
            noise=np.diag([1, 1, 0.1, 0.1]), A=A, B=B, sigma0=0.01, name="zoë ✈ \"quoted\"",
        )  # fmt: skip
        game = Game((agent,), name="double\\integrator")
        again = parse(game_to_toml(game))
        assert again == game
        assert again.agents[0].goal.tolist() == goal


def test_the_speed_of_three_dimensional_agents_is_read_with_three_inputs() -> None:
    text = MINIMAL.replace("[10.0, 50.0]", "[0, 0, 0]").replace("[95.0, 50.0]", "[9, 9, 9]")
    text = text.replace("{ box = [15.0, 15.0] }", "{ box = [1, 1, 1] }")
    control = parse(text.replace("{ box = [10.0, 10.0] }", "{ l1 = 2.0 }")).agents[0].control
    assert control == Polytope.l1(2.0, 3)


def test_a_number_stands_for_a_multiple_of_the_identity() -> None:
    game = parse(MINIMAL + "gain = 0.5\nnoise = 2.0\nsigma0 = 0.25\n")
    assert game == parse(
        MINIMAL + "gain = [[0.5, 0], [0, 0.5]]\nnoise = [[2, 0], [0, 2]]\n"
        "sigma0 = [[0.25, 0], [0, 0.25]]\n"
    )


@pytest.mark.parametrize(
    ("content", "word"),
    [(b"\xff\xfe\x00", "cannot be read"), (b"[game", "TOML"), (b"a = 1\na = 2", "TOML")],
)
def test_a_file_that_is_not_toml_is_refused(tmp_path: Path, content: bytes, word: str) -> None:
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=word) as caught:
        read_game(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(InputError, match=str(path)):
            read_game(path)
