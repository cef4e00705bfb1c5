from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from ppg_env import Game, InputError, evaluate, make_game, straight_plan
from ppg_env.formats.plan_file import read_plan, to_json, write_plan
from ppg_env.game.plan import Profile
from ppg_env.support.atomic_write import write_atomically
from tests.ppg_env.strategies import Play, plays


def straight(game: Game) -> Profile:
    return tuple(straight_plan(agent, game.horizon) for agent in game.agents)  # type: ignore[misc]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    game = make_game("head_on")
    return write_plan(tmp_path / "plan.json", game, straight(game), {"cost": [1.5, 2.5]})


def edit(path: Path, change: object) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    change(content)  # type: ignore[operator]
    path.write_text(json.dumps(content), encoding="utf-8")


def test_every_scenario_and_its_straight_plans_survive_exactly(game: Game, tmp_path: Path) -> None:
    profile = straight(game)
    write_plan(tmp_path / "plan.json", game, profile, {})
    again, plans, _ = read_plan(tmp_path / "plan.json")
    assert again == game
    assert plans == profile


@given(plays(missing=True))
def test_any_game_and_profile_survive_exactly(
    tmp_path_factory: pytest.TempPathFactory, play: Play
) -> None:
    path = tmp_path_factory.getbasetemp() / "any_plan.json"
    write_plan(path, play.game, play.profile, {})
    again, plans, _ = read_plan(path)
    assert again == play.game
    assert plans == play.profile


def test_other_entries_survive_as_they_were_written(path: Path) -> None:
    _, _, entries = read_plan(path)
    assert entries["cost"] == [1.5, 2.5]
    game = make_game("head_on")
    report = {"none": None, "text": "zoë", "deep": {"a": [1, 2.5, True]}, "big": np.float64(1e300)}
    write_plan(path, game, straight(game), report)
    _, _, entries = read_plan(path)
    assert {key: entries[key] for key in report} == report


def test_a_plan_file_is_one_json_object_that_carries_its_game(path: Path) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["game"]["game"]["name"] == "head_on"
    assert np.shape(content["controls"]) == (2, 15, 2)


def test_tampered_costs_means_and_arrivals_are_not_believed(path: Path) -> None:
    game, profile, _ = read_plan(path)
    edit(path, lambda c: c.update(cost=[-9e9, -9e9], means=[[[0, 0]]], arrival=[1, 1], regret=[0]))
    again, plans, entries = read_plan(path)
    assert (again, plans) == (game, profile)
    assert entries["cost"] == [-9e9, -9e9]  # kept, but evaluated again:
    np.testing.assert_array_equal(evaluate(again, plans).cost, evaluate(game, profile).cost)


def test_a_changed_game_is_the_one_that_is_judged(path: Path) -> None:
    edit(path, lambda c: c["game"]["agent"][0].update(lam=0.9))
    game, _, _ = read_plan(path)
    assert game.agents[0].lam == 0.9


def test_undefined_numbers_become_null() -> None:
    assert json.loads(
        to_json({"a": np.inf, "b": [float("nan"), np.int64(3)], "c": np.bool_(1)})
    ) == {
        "a": None,
        "b": [None, 3],
        "c": True,
    }


FAULTS = {
    "a list": lambda c: ["format"],
    "another format": lambda c: c | {"format": "something else"},
    "a later version": lambda c: c | {"version": 2},
    "no version": lambda c: {k: v for k, v in c.items() if k != "version"},
    "no game": lambda c: {k: v for k, v in c.items() if k != "game"},
    "no controls": lambda c: {k: v for k, v in c.items() if k != "controls"},
    "a game that is a list": lambda c: c | {"game": [1]},
    "controls that are a table": lambda c: c | {"controls": {"0": []}},
    "one agent's controls": lambda c: c | {"controls": c["controls"][:1]},
    "truncated controls": lambda c: c | {"controls": [c["controls"][0][:7], c["controls"][1]]},
    "ragged controls": lambda c: c | {"controls": [[[1.0, 2.0], [3.0]], c["controls"][1]]},
    "controls of null": lambda c: c | {"controls": [None, None]},
    "controls of text": lambda c: c | {"controls": [[["1", "0"]] * 15, c["controls"][1]]},
    "controls of NaN": lambda c: c | {"controls": [[[float("nan"), 0.0]] * 15, c["controls"][1]]},
    "endless controls": lambda c: c | {"controls": [[[float("inf"), 0.0]] * 15, c["controls"][1]]},
    "controls beyond floats": lambda c: c | {"controls": [[[10**400, 0]] * 15, c["controls"][1]]},
    "deep controls": lambda c: c | {"controls": [nested(80), c["controls"][1]]},
    "a shorter horizon": lambda c: edited(c, "game", horizon=14),
    "an agent less": lambda c: c | {"game": c["game"] | {"agent": c["game"]["agent"][:1]}},
    "a weight of 1": lambda c: edited_agent(c, lam=1.0),
    "a weight of null": lambda c: edited_agent(c, lam=None),
    "a start of null": lambda c: edited_agent(c, start=None),
    "bodies that overlap": lambda c: edited_agent(c, start=[88.0, 50.0]),
    "an unknown key": lambda c: edited_agent(c, speed=3),
    "flat noise": lambda c: edited_agent(c, noise=[[1.0, 2.0], [2.0, 1.0]]),
}


def nested(depth: int) -> object:
    value: object = 1.0
    for _ in range(depth):
        value = [value]
    return value


def edited(content: dict, table: str, **entries: object) -> dict:
    return content | {"game": content["game"] | {table: content["game"][table] | entries}}


def edited_agent(content: dict, **entries: object) -> dict:
    first, *rest = content["game"]["agent"]
    return content | {"game": content["game"] | {"agent": [first | entries, *rest]}}


@pytest.mark.parametrize("name", FAULTS)
def test_a_damaged_plan_is_refused_naming_file_and_remedy(path: Path, name: str) -> None:
    content = FAULTS[name](json.loads(path.read_text(encoding="utf-8")))
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_plan(path)
    assert str(caught.value).startswith(str(path))
    assert ";" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text", ["", "not json", "{", "[" * 100_000, "\x00", "null", "3", '{"a": ' + "1" * 5000 + "}"]
)
def test_what_is_no_json_object_is_refused(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=str(path)) as caught:
        read_plan(path)
    assert "\n" not in str(caught.value)


def test_missing_files_folders_and_other_encodings_are_refused(path: Path) -> None:
    path.with_name("latin.json").write_bytes(b'{"a": "\xff"}')
    for wrong in (path.with_name("none.json"), path.parent, path.with_name("latin.json")):
        with pytest.raises(InputError, match=str(wrong)):
            read_plan(wrong)


def test_a_write_that_fails_leaves_the_old_file_and_no_other(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import os

    old = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        write_atomically(path, "new")
    assert path.read_bytes() == old
    assert list(path.parent.iterdir()) == [path]


def test_a_report_that_is_no_json_leaves_the_old_file(path: Path) -> None:
    old, game = path.read_bytes(), make_game("head_on")
    with pytest.raises(TypeError):
        write_plan(path, game, straight(game), {"cost": object()})
    assert path.read_bytes() == old
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("where", ["missing/plan.json", "."])
def test_a_place_that_cannot_be_written_is_refused_with_nothing_left_behind(
    tmp_path: Path, where: str
) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_atomically(tmp_path / where, "text")
    assert list(tmp_path.iterdir()) == []


def test_files_are_written_with_the_usual_permissions(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.touch()
    written = write_atomically(tmp_path / "written", b"bytes")
    assert written.read_bytes() == b"bytes"
    assert written.stat().st_mode == plain.stat().st_mode
