"""``ppg render``: pictures of plans and of games."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ppg_env import make_game
from ppg_env.formats.game_file import game_to_toml
from tests.benchmarks.judges import picture_size
from tests.marks import first


def test_a_plan_becomes_a_picture(ppg, plan_file, tmp_path):
    picture = tmp_path / "plan.png"
    done = ppg("render", plan_file, "--out", picture)
    assert str(picture) in done.out + done.err
    assert min(picture_size(picture)) >= 400


@pytest.mark.parametrize("name", ["intersection3", "course", "circle(5)"])
def test_a_game_becomes_a_picture(ppg, tmp_path, name):
    picture = tmp_path / "game.png"
    assert ppg("render", name, "--speed", "l1", "--out", picture, "--json").json == {
        "picture": str(picture)
    }
    assert min(picture_size(picture)) >= 400


@pytest.mark.slow
def test_a_game_of_another_dimension_becomes_a_picture(ppg, tmp_path):
    body = "lam = 0.5\ngain = 0.5\nnoise = 0.1\n"
    for dim in (1, 3):
        ones = [1.0] * dim
        text = "".join(
            f"[[agent]]\nstart = {[s] * dim}\ngoal = {[g] * dim}\n{body}"
            f"shape = {{ box = {ones} }}\ncontrol = {{ box = {ones} }}\n"
            for s, g in ((0.0, 3.0), (8.0, 5.0))
        )
        file, plan = tmp_path / f"game{dim}.toml", tmp_path / f"plan{dim}.json"
        file.write_text(text)
        ppg("solve", file, "--solution", "social", "--out", plan)
        for source in (file, plan):
            ppg("render", source, "--out", tmp_path / "picture.png")
            picture_size(tmp_path / "picture.png")


def test_a_plan_takes_no_game_options(ppg, plan_file, tmp_path):
    done = ppg("render", plan_file, "--lam", "0.2", "--out", tmp_path / "no.png", code=2)
    assert "--lam" in done.err
    assert not (tmp_path / "no.png").exists()


def test_a_folder_that_does_not_exist_is_exit_code_2(ppg, plan_file, tmp_path):
    done = ppg("render", plan_file, "--out", tmp_path / "no" / "plan.png", code=2)
    assert "folder" in done.err


@pytest.mark.parametrize(
    ("kind", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_pictures_have_the_kind_of_their_ending_and_are_equal_again(
    ppg, plan_file, tmp_path, kind, start
):
    contents = []
    for name in ("one", "two"):
        picture = tmp_path / f"{name}.{kind}"
        ppg("render", plan_file, "--out", picture)
        contents.append(picture.read_bytes())
    assert contents[0].startswith(start)
    assert contents[0] == contents[1]


def test_another_kind_of_picture_is_refused(ppg, plan_file, tmp_path):
    done = ppg("render", plan_file, "--out", tmp_path / "plan.bmp", code=2)
    assert "name a .png, .svg or .pdf file" in done.err


@pytest.mark.parametrize("name", first(1, ["robot [/2]", "$x^{$", "_hidden", "<b>&"]))
def test_names_are_drawn_and_printed_as_they_are(ppg, tmp_path, name):
    game = replace(make_game("head_on"), name=name)
    first, second = game.agents
    game = replace(game, agents=(replace(first, name=name), second))
    file, picture = tmp_path / "game.toml", tmp_path / "game.svg"
    file.write_text(game_to_toml(game))
    assert name in ppg("show", file).out
    ppg("render", file, "--out", picture)
    assert (
        f"<!-- {name.replace('&', '&amp;').replace('<', '&lt;').replace('>', '&gt;')} -->"
        in picture.read_text()
    )
    words = ("--players", "social", "--episodes", "100", "--out", tmp_path / "compare.svg")
    assert name in ppg("compare", file, *words).out


def test_a_game_file_without_a_name_is_called_as_the_file(ppg, tmp_path):
    file = tmp_path / "yard [7].toml"
    file.write_text(game_to_toml(replace(make_game("head_on"), name=None)))
    assert "yard [7]" in ppg("solve", file).out


def test_without_matplotlib_a_table_is_enough(ppg, tmp_path, monkeypatch):
    monkeypatch.setattr("benchmarks.figures.find_spec", lambda name: None)
    words = ("compare", "head_on", "--players", "social", "--episodes", "100")
    done = ppg(*words)
    assert "social" in done.out
    assert "no picture without matplotlib" in done.err
    assert "needs matplotlib" in ppg(*words, "--out", tmp_path / "compare.png", code=2).err
