"""Grids: the same sweep on the command line and in a file; every mistake in one sentence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.sweeps.grid import Grid, field_values, is_grid, read_grid, whole_numbers
from ppg_env import InputError, make_game
from ppg_env.formats.game_file import game_to_toml

FILE = """
[sweep]
games = ["head_on", "own.toml"]
players = ["nash", "social"]
starts = ["straight", "sequential"]
orders = ["cyclic", [1, 0]]
charges = ["selfish", "partial:0.5"]
seeds = "3:5"
episodes = 100
time_limit = 5
[set]
lam = [0.1, [0.2, 0.8]]
speed = ["l1"]
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "own.toml").write_text(game_to_toml(make_game("parallel")))
    path = tmp_path / "sweep.toml"
    path.write_text(FILE)
    return path


def test_a_file_says_what_options_say(file):
    grid = read_grid(file)
    assert grid == Grid(
        games=("head_on", str(file.with_name("own.toml"))),
        values={"lam": [0.1, [0.2, 0.8]], "speed": ["l1"]},
        players=("nash", "social"),
        starts=("straight", "sequential"),
        orders=("cyclic", (1, 0)),
        charges=("selfish", "partial:0.5"),
        seeds=(3, 4),
        episodes=100,
        time_limit=5.0,
    )
    cells = grid.cells()
    assert len(cells) == len({cell.address for cell in cells}) == 2 * 2 * (8 + 1) * 2
    assert [agent.lam for agent in cells[-1].game.agents] == [0.2, 0.8]
    assert cells[-1].game.name == "parallel"


def test_only_the_players_that_heed_them_have_starts_orders_and_charges():
    grid = Grid(("head_on",), players=("straight", "nash"), starts=("straight", "sequential"))
    assert [(cell.player, cell.start) for cell in grid.cells()] == [
        ("straight", None),
        ("nash", "straight"),
        ("nash", "sequential"),
    ]
    charged = replace(
        grid, players=("nash", "social", "receding-social"), charges=("selfish", "pigou")
    )
    assert [(cell.player, cell.start, cell.charge) for cell in charged.cells()] == [
        ("nash", "straight", "selfish"),
        ("nash", "straight", "pigou"),
        ("nash", "sequential", "selfish"),
        ("nash", "sequential", "pigou"),
        ("social", None, "selfish"),
        ("receding-social", None, "selfish"),
    ]


def test_the_arena_is_the_environment_if_a_player_needs_it():
    names = ("nash", "receding-nash")
    assert {cell.arena for cell in Grid(("head_on",), players=names).cells()} == {"env"}
    assert {cell.arena for cell in Grid(("head_on",), players=names[:1]).cells()} == {"schedule"}


def test_games_and_sweeps_are_distinguished(file):
    assert is_grid(str(file))
    assert not is_grid(str(file.with_name("own.toml")))
    assert not is_grid("head_on")


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("lam=0.1,0.5", [0.1, 0.5]),
        ("lam=[0.2,0.8],0.5", [[0.2, 0.8], 0.5]),
        ("horizon=15", [15]),
        ("speed=l1, disc", ["l1", "disc"]),
        ('speed="l1"', ["l1"]),
        ("noise=[[1.0,0.0],[0.0,2.0]]", [[[1.0, 0.0], [0.0, 2.0]]]),
    ],
)
def test_values_on_the_command_line(text, values):
    assert field_values(text) == (text.partition("=")[0], values)


@pytest.mark.parametrize("text", ["lam", "lam=", "=0.5", ""])
def test_values_that_are_none(text):
    with pytest.raises(InputError, match="--set"):
        field_values(text)


@pytest.mark.parametrize(
    ("text", "found"), [("0:3", (0, 1, 2)), (":2", (0, 1)), ("1,4", (1, 4)), ([7], (7,))]
)
def test_whole_numbers(text, found):
    assert whole_numbers("seeds", text) == found


@pytest.mark.parametrize("text", ["", "3:3", "a:b", "1.5", [1.5], [True], "1:2:3", 4])
def test_what_is_no_whole_number(text):
    with pytest.raises(InputError, match="seeds"):
        whole_numbers("seeds", text)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[set]", "[put]", "put: is not a key of the file"),
        ("seeds", "sods", "sods: is not a key of"),
        ('games = ["head_on", "own.toml"]', "", "sweep.games: is missing"),
        ('["head_on", "own.toml"]', '"head_on"', "sweep.games: is 'head_on'"),
        ('["nash", "social"]', "[1]", "sweep.players: is "),
        ('"3:5"', "true", "sweep.seeds"),
        ("episodes = 100", "episodes = 1.5", "sweep.episodes"),
        ("time_limit = 5", "time_limit = -5", "sweep.time_limit"),
        ('speed = ["l1"]', 'speed = "l1"', "set.speed"),
        ('speed = ["l1"]', "speed = []", "set.speed"),
        ("[set]", "[set", "not valid TOML"),
    ],
)
def test_mistakes_in_a_file_name_the_place(file, old, new, message):
    file.write_text(FILE.replace(old, new))
    with pytest.raises(InputError) as error:
        read_grid(file)
    assert message in str(error.value)
    assert str(file) in str(error.value)


def test_rules_of_collisions_and_goals_are_axes():
    values = {"collisions": ["instants", "swept"], "on_goal": ["remove", "stay"]}
    cells = Grid(("head_on",), values, ("straight",)).cells()
    rules = [(cell.game.collisions, cell.game.on_goal) for cell in cells]
    assert rules == [(c, g) for c in values["collisions"] for g in values["on_goal"]]
    assert len({cell.address for cell in cells}) == 4
