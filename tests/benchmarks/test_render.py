"""``ppg render``: pictures of plans and of games."""

from __future__ import annotations

import pytest

from tests.benchmarks.judges import picture_size


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
