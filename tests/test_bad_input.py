"""Errors in a game file: one sentence that names file, place and remedy.

Every field, wrong or missing; then faults that hypothesis generates.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import given

from ppg_env import Game, InputError
from ppg_env.formats.game_file import game_from_tables, game_to_tables, read_game
from ppg_env.game.input_sets import pieces
from tests.oracles.faults import CASES, ELSEWHERE, SQUARE, VALID, changed, faulty
from tests.profiles import examples


def written(place: str) -> str:
    """``agent.0.noise`` as messages write it: ``agent[0].noise``."""
    return re.sub(r"\.(\d+)", r"[\1]", place)


def assert_is_one_clear_sentence(message: str, source: str) -> None:
    assert message.startswith(f"{source}: "), "names the file"
    assert "\n" not in message, "is one line"
    assert re.search(r"[^;]; \w.*\.$", message), "ends with a remedy"


def test_the_valid_file_is_valid(tmp_path: Path) -> None:
    path = tmp_path / "valid.toml"
    path.write_text(tomli_w.dumps(VALID), encoding="utf-8")
    game = read_game(path)
    assert len(game.agents) == 3
    assert game_from_tables(game_to_tables(game), "again") == game


@pytest.mark.parametrize(("place", "fault"), CASES, ids=lambda value: str(value)[:50])
def test_each_fault_of_a_game_file_is_reported_with_file_place_and_remedy(
    place: str, fault: Any, tmp_path: Path
) -> None:
    path = tmp_path / "faulty.toml"
    path.write_text(tomli_w.dumps(changed(VALID, place, fault)), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_game(path)
    message = str(caught.value)
    assert_is_one_clear_sentence(message, str(path))
    expected = ELSEWHERE.get(place, re.escape(written(place)))
    assert re.match(expected, message.removeprefix(f"{path}: ")), message


OVERLAPS = {
    "two agents": ("agent.1.start", [1.0, 1.0], r"agent\[0\]\.start: overlaps agent\[1\]"),
    "an agent and an obstacle": (
        "obstacle.0.vertices",
        [[x + 19, y + 19] for x, y in SQUARE],
        r"agent\[1\]\.start: overlaps obstacle\[0\]",
    ),
    "two names": ("agent.2.name", "anna", r"agent.*'anna'"),
    "another's default name": ("agent.0.name", "agent_2", r"agent.*'agent_2'"),
}


@pytest.mark.parametrize("name", OVERLAPS)
def test_what_clashes_is_reported_with_both_parties(name: str, tmp_path: Path) -> None:
    place, value, expected = OVERLAPS[name]
    path = tmp_path / "clash.toml"
    path.write_text(tomli_w.dumps(changed(VALID, place, value)), encoding="utf-8")
    with pytest.raises(InputError, match=expected) as caught:
        read_game(path)
    assert_is_one_clear_sentence(str(caught.value), str(path))


@pytest.mark.parametrize(
    "text",
    [
        "start = [1, 2",
        "[[agent]]\nstart = [1, 2",
        "horizon = " + "1" * 5000,
        "a = " + "[" * 5000 + "]" * 5000,
        "[game]\n\"a\\nb\" = 1",
        "\"a\\nb\" = 1",
        "[[agent]]\nstart = [0, 0]\ngoal = [1, 1]\nshape = { \"a\\nb\" = 1 }\ncontrol = { l1 = 1 }",
        "[[agent]]\nstart = [0, 0]\ngoal = [1, 1]\n\"a\\nb\" = 1",
    ],
    ids=lambda text: text[:20],
)  # fmt: skip
def test_strange_text_is_reported_in_one_line(text: str, tmp_path: Path) -> None:
    path = tmp_path / "strange.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_game(path)
    assert_is_one_clear_sentence(str(caught.value), str(path))


def assert_is_usable_or_refused(tables: dict[str, Any]) -> None:
    source = "some/file.toml"
    try:
        game = game_from_tables(tomllib.loads(tomli_w.dumps(tables)), source)
    except InputError as error:
        assert_is_one_clear_sentence(str(error), source)
        place = str(error).removeprefix(f"{source}: ")
        assert re.match(r"(game|agent|obstacle|bogus)\b", place), "names a place"
        return
    assert isinstance(game, Game)
    sets = (held for agent in game.agents for _, held in pieces(agent.control))
    bodies = [body.shape for body in (*game.obstacles, *game.agents)]
    for polytope in (*bodies, *sets):
        assert len(polytope.normals) == len(polytope.offsets) > 0
    assert game_from_tables(game_to_tables(game), "again") == game


@given(faulty())
def test_a_made_up_file_is_a_usable_game_or_refused(tables: dict[str, Any]) -> None:
    assert_is_usable_or_refused(tables)


@pytest.mark.slow
@examples(5)
@given(faulty())
def test_more_made_up_files_are_usable_games_or_refused(tables: dict[str, Any]) -> None:
    assert_is_usable_or_refused(tables)
