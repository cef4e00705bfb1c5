"""A cell's address: everything that determines the result, and nothing else."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines import read_learned, write_learned
from benchmarks.sweeps import Cell
from ppg_env import InputError, make_game
from ppg_env.formats.game_file import game_to_toml
from ppg_env.game.polytope import Polytope

CELL = Cell("head_on", "nash", {"speed": "l1"}, arena="env")


@pytest.mark.parametrize(
    "change",
    [
        {"scenario": "parallel"},
        {"fields": {"speed": "disc"}},
        {"fields": {"control": [(0, Polytope.l1(10.0)), (5, Polytope.l1(9.0))]}},
        {"fields": {"speed": "l1", "lam": [0.5, 0.4]}},
        {"fields": {"speed": "l1", "crash_cost": 101}},
        {"fields": {"speed": "l1", "collisions": "swept"}},
        {"fields": {"speed": "l1", "on_goal": "stay"}},
        {"fields": {"speed": "l1", "reserve": 1.0}},
        {"fields": {"speed": "l1", "effort": 0.01}},
        {"player": "social"},
        {"player": "ppo-social", "fields": {"speed": "l1", "lam": 0.5}},
        {"start": "sequential"},
        {"order": "random"},
        {"order": (1, 0)},
        {"arena": "schedule"},
        {"episodes": 10_001},
        {"groups": 5},
        {"seed": 1},
        {"solver": "HIGHS"},
        {"time_limit": 9.0},
    ],
    ids=str,
)
def test_what_changes_the_result_changes_the_address(change):
    assert replace(CELL, **change).address != CELL.address


@pytest.mark.parametrize(
    "change",
    [
        {"fields": {"speed": "l1", "horizon": 15, "lam": 0.5}},  # the defaults
        {"fields": {"lam": [0.5, 0.5], "speed": "l1", "crash_cost": 100}},
        {"fields": {"control": {"l1": 10}}},
        {"fields": {"speed": "l1", "collisions": "instants", "on_goal": "remove"}},
        {"fields": {"speed": "l1", "reserve": 0, "effort": 0.0}},
        {"node_limit": 100},  # no effect for nash
    ],
    ids=str,
)
def test_what_changes_nothing_does_not(change):
    assert replace(CELL, **change).address == CELL.address


@pytest.mark.parametrize(
    "change", [{"start": "sequential"}, {"order": "random"}, {"charge": "pigou"}], ids=str
)
def test_options_of_nash_do_not_matter_to_others(change):
    social = replace(CELL, player="social", arena="schedule")
    assert replace(social, **change).address == social.address
    nash = replace(social, player="nash")
    assert replace(nash, **change).address != nash.address
    assert replace(social, groups=3).address == social.address  # on schedule there are none
    assert replace(social, node_limit=10).address != social.address


@given(st.floats(0, 0.999), st.floats(0, 0.999))
def test_addresses_agree_just_when_the_numbers_do(one, other):
    first, second = (Cell("parallel", "nash", {"lam": lam}).address for lam in (one, other))
    assert (first == second) == (one == other)


def test_a_whole_number_is_the_number():
    assert replace(CELL, time_limit=9).address == replace(CELL, time_limit=9.0).address


def test_a_game_file_counts_by_what_it_says(tmp_path: Path):
    path, copy = tmp_path / "one.toml", tmp_path / "two.toml"
    path.write_text(game_to_toml(make_game("head_on", speed="l1")))
    copy.write_text("# the same\n" + path.read_text())
    first = replace(CELL, scenario=str(path), fields={})
    assert first.address == replace(first, scenario=str(copy)).address == CELL.address
    copy.write_text(path.read_text().replace("lam = 0.5", "lam = 0.25"))
    assert replace(first, scenario=str(copy)).address != CELL.address


def test_a_learned_player_counts_by_its_file(learned_file: Path, tmp_path: Path):
    cell = Cell("intersection", str(learned_file), {"speed": "l1"}, arena="env")
    copy = tmp_path / "copy.npz"
    copy.write_bytes(learned_file.read_bytes())
    assert replace(cell, player=str(copy)).address == cell.address
    learned = read_learned(learned_file)
    write_learned(copy, replace(learned, runs=learned.runs[::-1]))
    assert replace(cell, player=str(copy)).address != cell.address


def test_a_copy_in_another_process_looks_for_itself(tmp_path: Path):
    path = tmp_path / "game.toml"
    path.write_text(game_to_toml(make_game("head_on")))
    cell = Cell(str(path), "nash")
    before = cell.address
    assert pickle.loads(pickle.dumps(cell)).address == before
    path.write_text(game_to_toml(make_game("parallel")))
    assert cell.address == before
    assert pickle.loads(pickle.dumps(cell)).address != before


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"player": "stranger"}, "use names of"),
        ({"player": "nash,social"}, "name one"),
        ({"player": "ppo-social", "arena": "schedule"}, "needs the environment"),
        ({"episodes": 0}, "episodes"),
        ({"seed": -1}, "seed"),
        ({"arena": "moon"}, "schedule or env"),
    ],
    ids=str,
)
def test_mistakes_are_reported_at_once(words, message):
    with pytest.raises(InputError, match=message):
        replace(CELL, **words)


@pytest.mark.parametrize(
    "cell",
    [
        Cell("nowhere", "nash"),
        Cell("head_on", "nash", {"lam": 2}),
        Cell("head_on", "gone.npz", arena="env"),
        Cell("head_on", "ppo-social", {"horizon": 20}, arena="env"),
    ],
    ids=lambda cell: f"{cell.scenario} {cell.player} {cell.fields}",
)
def test_a_cell_of_nothing_has_no_address(cell):
    with pytest.raises(InputError):
        _ = cell.address
