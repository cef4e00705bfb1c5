"""``ppg study``: rows are stored, and presented in tables, figures and sentences."""

from __future__ import annotations

import json

import numpy as np
import pytest

from baselines.pretrained import find_pretrained
from benchmarks.studies.learned import data as learned
from benchmarks.studies.learned import study as learned_study
from benchmarks.studies.results import completed, read_rows, write_rows
from benchmarks.studies.tightness import data as tightness
from benchmarks.studies.tightness import study as tightness_study
from ppg_env import InputError
from tests.benchmarks.judges import picture_size

FEW = ["--scenarios", "parallel", "--speeds", "l1", "--lams", "0.5,0.8", "--episodes", "1000"]


def interval(value, low=None, high=None):
    return {"value": value, "low": low or value * 0.9, "high": high or value * 1.1}


def row(scenario, cost, risk, paired=-0.1):
    price = {"cost": interval(cost), "risk": interval(risk)}
    return {
        "scenario": scenario,
        "speed": "l1",
        "lam": 0.5,
        "players": {},
        "price": {"planned": price, "learned": price},
        "paired": {
            name: {"value": paired, "low": paired - 0.01, "high": paired + 0.01}
            for name in learned.RIVALS
        },
    }


@pytest.mark.slow
def test_a_study_is_stored_reported_and_drawn(ppg, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = ppg("study", "learned", *FEW)
    assert "parallel" in done.out
    assert "ppo-selfish compared with tracked nash" in " ".join(done.out.split())
    picture_size(tmp_path / "out" / "learned-l1.png")
    stored = json.loads((tmp_path / "out" / "learned.json").read_text())["rows"]
    assert [one["lam"] for one in stored] == [0.5, 0.8]
    for one in stored:
        assert set(one["players"]) == set(learned.PLAYERS)
        for found in one["players"].values():
            assert found["success"]["value"] > 0.9

    def run_again(*_):
        raise AssertionError("all rows are stored")

    monkeypatch.setattr(learned, "evaluate_runs", run_again)
    again = ppg("study", "learned", *FEW, "--json").json
    assert again["rows"] == stored
    assert ppg("study", "learned", *FEW).out == done.out


@pytest.mark.slow
def test_rows_do_not_depend_on_the_number_of_processes(ppg, tmp_path):
    words = ["study", "learned", *FEW, "--json", "--results"]
    one = ppg(*words, tmp_path / "one.json").json
    two = ppg(*words, tmp_path / "two.json", "--jobs", "2").json
    assert one == two


def test_the_figures_of_a_cell_are_those_of_the_runs():
    """A learner's cost is the mean over its runs, each in its own group of episodes."""
    from baselines.evaluate_runs import evaluate_runs

    cell = learned.LearnedCell("parallel", "l1", 0.5)
    found = learned.run_cell(cell, 500, seed=2)["players"]["ppo-social"]
    game = cell.game()
    social = find_pretrained("ppo-social", game)
    judged = evaluate_runs(game, [social.players(game, r) for r in range(5)], 500, seed=2)
    assert found["cost"]["value"] == pytest.approx(float(np.mean(judged.costs)))


def test_words_count_what_the_rows_say():
    rows = [row("a", 1.0, 5.0), row("a", 1.2, 5.0), row("b", 1.01, 0.5), row("b", 1.0, 1.0, 0.2)]
    said = list(learned_study.words(rows))
    assert "at most 5% in 3 of 4 cells (ratio 1.000 to 1.200)" in said[0]
    assert "more likely in 2 cells, less likely in 1, no significant difference in 1" in said[0]
    assert "About the same cost and less safe, as the paper claims: 1 cells" in said[0]
    assert "a l1 2/2, b l1 0/2" in said[1]
    assert "differ by more than 5% in 1 cell (a l1 0.5)" in said[2]
    assert "safer in 1 cell (b l1 0.5)" in said[2]
    assert "cheaper in 3 of 4 cells, no significant difference in 0" in said[-1]
    assert "costlier in 1 cell (b l1 0.5)" in said[-1]


def test_stored_rows_are_not_run_again_and_others_are_kept(tmp_path):
    path, ran = tmp_path / "rows.json", []

    def run(cell):
        ran.append(cell)
        return {"cell": cell}

    def same(cell, old):
        return old["cell"] == cell

    write_rows(path, "test", [{"cell": 1}, {"cell": 9}])
    rows = completed(path, "test", [1, 2, 3], run, same)
    assert ran == [2, 3]
    assert [one["cell"] for one in rows] == [1, 2, 3]
    assert sorted(one["cell"] for one in read_rows(path, "test")) == [1, 2, 3, 9]


def test_a_run_that_fails_loses_no_row(tmp_path):
    path = tmp_path / "rows.json"

    def run(cell):
        if cell == 2:
            raise KeyboardInterrupt
        return {"cell": cell}

    with pytest.raises(KeyboardInterrupt):
        completed(path, "test", [1, 2], run, lambda cell, old: old["cell"] == cell)
    assert [one["cell"] for one in read_rows(path, "test")] == [1]


def test_files_of_something_else_are_refused(tmp_path):
    path = tmp_path / "rows.json"
    write_rows(path, "other", [])
    with pytest.raises(InputError, match="study"):
        read_rows(path, "test")
    path.write_text("{")
    with pytest.raises(InputError, match="cannot be read"):
        read_rows(path, "test")


def test_a_study_can_take_scenarios_beyond_its_own(ppg, tmp_path):
    words = ["study", "feedback", "--scenarios", "intersection3", "--lams", "0.99"]
    assert "ppg train" in ppg(*words, "--results", tmp_path / "rows.json", code=2).err
    assert "use names of" in ppg("study", "feedback", "--scenarios", "circle(4)", code=2).err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["magic"], "learned or tightness or price"),
        (["tightness", "--speeds", "warp"], "disc"),
        (["learned", "--scenarios", "here"], "head_on"),
        (["learned", "--speeds", "fast"], "disc"),
        (["learned", "--lams", "x"], "write a number"),
        (["learned", "--lams", "0.99"], "ppg train"),
        (["learned", "--results", "none/a.json"], "no folder"),
    ],
    ids=" ".join,
)
def test_mistakes_are_reported_in_one_line(ppg, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    done = ppg("study", *words, code=2)
    assert message in done.err
    assert "Traceback" not in done.err


@pytest.mark.slow
def test_the_study_of_bounds_is_stored_reported_and_drawn(ppg, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["study", "tightness", "--scenarios", "intersection", "--lams", "0.8"]
    words += ["--episodes", "2000"]
    done = ppg(*words)
    assert "speed set l1" in done.out
    assert "Order: " in done.out
    picture_size(tmp_path / "out" / "tightness-l1.png")
    rows = ppg(*words, "--json").json["rows"]
    assert len(rows) == 8
    assert rows == json.loads((tmp_path / "out" / "tightness.json").read_text())["rows"]
    for one in rows:
        bounds = [one["bounds"][name] for name in tightness.BOUNDS]
        assert bounds == sorted(bounds, reverse=True)
        assert one["low"] <= one["hits"] / 2000 <= one["high"]


def tight(scenario, bounds, hits, low):
    names = dict(zip((*tightness.BOUNDS, "least"), (*bounds, 0.0), strict=True))
    return {
        "scenario": scenario,
        "bounds": names,
        "hits": hits,
        "episodes": 1000,
        "low": low,
    }


def test_words_on_bounds_say_whether_the_order_holds():
    good = tight("a", (0.8, 0.6, 0.4, 0.2), 200, 0.15)
    rare = tight("b", (0.8, 0.6, 0.4, 0.01), 1, 0.0)
    said = list(tightness_study.words([good, rare]))
    assert "in 2 of 2 plans" in said[0]
    assert "The paper's bound: 4 times the count in the median plan of 1" in said[1]
    assert "Less shared: 1 times" in said[4]
    assert "a 4, b 80" in said[5]
    assert "in 1 of 2 plans" in next(tightness_study.words([good, rare | {"hits": 40}]))
