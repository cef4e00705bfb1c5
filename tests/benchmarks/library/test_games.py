"""The games of the library never change, come from their generators, and differ in kind."""

from __future__ import annotations

import tomllib
from collections import Counter

import pytest

from benchmarks.library.families.generate import drafts, read_digests, write_games
from benchmarks.library.families.toml_text import toml_text
from benchmarks.library.instance import FOLDER, instances

GAMES = instances()


def test_no_file_of_a_game_has_changed():
    digests = read_digests(FOLDER)
    files = {f"{path.parent.name}/{path.name}" for path in FOLDER.glob("*/*.toml")}
    assert files == set(digests)
    assert {f"{one.name}.toml": one.digest for one in GAMES} == digests


def test_the_library_is_as_large_and_varied_as_it_claims():
    assert len(GAMES) >= 200
    agents = Counter(len(one.tables["agent"]) for one in GAMES)
    assert min(agents) == 1
    assert max(agents) == 50
    for key in ("objective", "collisions", "on_goal"):
        assert len({one.tables["game"][key] for one in GAMES}) == 2
    assert sum(path.stat().st_size for path in FOLDER.rglob("*.*")) < 40e6


@pytest.mark.slow
def test_generators_write_the_files_that_are_there():
    texts = {name: toml_text(name, tables) for name, tables in drafts()}
    for one in GAMES:
        if one.path.stem == "1":
            assert one.path.read_text() == texts[one.path.parent.name]
            assert tomllib.loads(texts[one.path.parent.name])["game"]["name"]


@pytest.mark.slow
def test_a_changed_file_keeps_its_first_digest(tmp_path):
    assert write_games(tmp_path) == len(GAMES)
    first = read_digests(tmp_path)
    path = tmp_path / "noise0.0-gain0.0" / "1.toml"
    path.write_text(path.read_text() + "# a comment\n")
    assert write_games(tmp_path) == 0
    assert read_digests(tmp_path) == first
    assert "comment" in path.read_text()


@pytest.mark.slow
@pytest.mark.parametrize("one", GAMES, ids=lambda one: one.name)
def test_every_game_is_valid_and_its_goals_are_in_reach(one):
    from ppg_env.game.least_effort import straight_plan

    assert one.game.name == one.path.parent.name
    for agent in one.game.agents:
        assert straight_plan(agent, one.game.horizon) is not None
