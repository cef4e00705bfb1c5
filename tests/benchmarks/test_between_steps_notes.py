"""Commands and pictures report where means pass through something between two time steps."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.comparison import pictures, snapshots
from benchmarks.comparison.overlaps import between_steps_note
from benchmarks.figures import new_figure
from ppg_env import Game, Polytope, make_game, make_profile
from ppg_env.formats.plan_file import read_plan
from ppg_env.game import Obstacle, overlaps_between_steps
from ppg_env.plotting import draw_game, draw_profile
from solvers import social_optimum
from tests.benchmarks.judges import picture_size
from tests.marks import first

LOOKS = "this game looks at the time steps only: plan with --collisions swept"
BODY = """noise = 0.0001
gain = 0.5
lam = 0.8
shape = { box = [1.0, 1.0] }
control = { box = [3.0, 3.0] }
"""
FEW = ("--players", "social", "--episodes", "100")
KEYS = {"agents", "obstacle", "step", "moment", "depth", "place"}


def corridor(path: Path, collisions: str, width: float) -> Path:
    """Write a game of two bodies of width 1 that swap places between two walls."""
    text = f'[game]\nhorizon = 5\nmargin_cap = 1.0\ncollisions = "{collisions}"\n'
    for start, goal in ((-4.0, 4.0), (4.0, -4.0)):
        text += f"[[agent]]\nstart = [{start}, 0.0]\ngoal = [{goal}, 0.0]\n{BODY}"
    for low, high in ((width / 2, 9.0), (-9.0, -width / 2)):
        corners = [[-9.0, low], [9.0, low], [9.0, high], [-9.0, high]]
        text += f"[[obstacle]]\nvertices = {corners}\n"
    path.write_text(text)
    return path


@pytest.fixture
def narrow(tmp_path: Path) -> Path:
    """A corridor one lane wide: in five steps only plans through the other body exist."""
    return corridor(tmp_path / "narrow.toml", "instants", 1.2)


def noted(out: str) -> list[str]:
    return [line for line in out.splitlines() if "between steps" in line]


@pytest.mark.parametrize("solution", ["nash", "potential", "social"])
def test_solve_reports_in_one_line_who_passes_through_whom(ppg, narrow, solution):
    done = ppg("solve", narrow, "--solution", solution)
    (line,) = noted(done.out)
    assert line.startswith("between steps 1 and 2 the means of agent_0 and agent_1 overlap by ")
    assert line.endswith(f"; {LOOKS}")


def test_solve_has_it_in_json(ppg, narrow):
    report = ppg("solve", narrow, "--solution", "social", "--json").json
    assert report["collisions"] == "instants"
    (place,) = report["between_steps"]
    assert set(place) == KEYS
    assert (place["agents"], place["obstacle"], place["step"]) == ([0, 1], None, 1)
    assert 0.9 <= place["depth"] <= 1.0  # a body's width, less what the corridor leaves
    assert place["moment"] == pytest.approx(0.5, abs=0.2)
    assert place["place"] == pytest.approx([0.0, 0.0], abs=0.3)


@pytest.mark.slow
def test_a_plan_that_keeps_apart_has_nothing_to_report(ppg, tmp_path):
    wide = corridor(tmp_path / "wide.toml", "swept", 4.0)
    plan = tmp_path / "wide.json"
    table = ppg("solve", wide, "--solution", "social", "--out", plan)
    report = json.loads(plan.read_text())
    assert (report["collisions"], report["between_steps"]) == ("swept", [])
    outputs = (
        table,
        ppg("certify", plan),
        ppg("render", plan, "--out", tmp_path / "wide.png"),
    )
    assert [noted(done.out) for done in outputs] == [[]] * len(outputs)


def test_swept_finds_no_plan_where_only_passing_through_would_do(ppg, tmp_path):
    narrow = corridor(tmp_path / "narrow.toml", "swept", 1.2)
    report = ppg("solve", narrow, "--solution", "social", "--json", code=3).json
    assert report["status"] == "infeasible"
    assert "overlap of means during the steps" in report["advice"]
    assert "between_steps" not in report


def test_short_bodies_head_on_pass_through_each_other_unless_steps_count():
    """On l1 speeds, the way around costs a step: 9.5 where straight flight would cost 9."""
    fields = {"speed": "l1", "shape": Polytope.box([4.0, 4.0]), "noise": 0.05}
    through = social_optimum(make_game("head_on", **fields))
    (overlap,) = overlaps_between_steps(through.game, through.profile)
    assert (overlap.step, overlap.depth) == (4, pytest.approx(4.0))
    assert through.value == pytest.approx(9.0)
    around = social_optimum(make_game("head_on", collisions="swept", **fields))
    assert overlaps_between_steps(around.game, around.profile) == ()
    assert around.value == pytest.approx(9.5)


def test_an_infeasible_game_says_that_the_time_steps_count(ppg):
    words = ["--horizon", "9", "--speed", "l1", "--json"]
    report = ppg("solve", "head_on", "--solution", "social", *words, code=3).json
    assert "overlap of means at the time steps" in report["advice"]


def test_certify_and_render_report_it_for_plan_files(ppg, narrow, tmp_path):
    plan, picture = tmp_path / "plan.json", tmp_path / "plan.png"
    ppg("solve", narrow, "--solution", "social", "--out", plan)
    expected = json.loads(plan.read_text())["between_steps"]
    assert len(expected) == 1
    for words in (["certify", plan], ["render", plan, "--out", picture]):
        (line,) = noted(ppg(*words).out)
        assert line.endswith(LOOKS)
        assert ppg(*words, "--json").json["between_steps"] == expected
    picture_size(picture)


def test_compare_reports_the_deepest_and_the_other_players(ppg, narrow, tmp_path):
    words = ["compare", narrow, "--players", "social,straight", "--episodes", "200"]
    (line,) = noted(ppg(*words, "--out", tmp_path / "compare.png").out)
    assert "the means of agent_0 and agent_1 overlap by " in line
    assert "(also s" in line
    assert line.endswith(LOOKS)
    report = ppg(*words, "--json").json
    assert report["collisions"] == "instants"
    assert [row["between_steps"][0]["step"] for row in report["rows"]] == [1, 1]


def test_equilibria_report_it_by_kind(ppg, narrow):
    (line,) = noted(ppg("equilibria", narrow, "--runs", "2").out)
    assert "0<1 " in line.split(":")[0]
    report = ppg("equilibria", narrow, "--runs", "2", "--json").json
    assert all(len(kind["between_steps"]) == 1 for kind in report["equilibria"])


def test_the_note_names_few_other_plans_and_counts_many(ppg, narrow, tmp_path):
    ppg("solve", narrow, "--solution", "social", "--out", tmp_path / "plan.json")
    game, profile, _ = read_plan(tmp_path / "plan.json")
    for count, named in ((3, " (also b, c, d); "), (4, " (also 4 other plans); ")):
        plans = dict.fromkeys("abcde"[: count + 1], profile)
        assert named in between_steps_note(game, plans)
    assert between_steps_note(game, {"a": None}) == ""


def test_the_note_counts_the_other_places_of_the_plan(tmp_path):
    """Straight flight across two thin walls."""
    agent = "[[agent]]\nstart = [0.0, 0.0]\ngoal = [12.0, 0.0]\n" + BODY
    walls = [
        f"[[obstacle]]\nvertices = {[[x, -9.0], [end, -9.0], [end, 9.0], [x, 9.0]]}\n"
        for x, end in ((1.4, 1.6), (4.4, 4.8))
    ]
    path = tmp_path / "walls.toml"
    path.write_text('[game]\nhorizon = 5\ncollisions = "instants"\n' + agent + "".join(walls))
    game = make_game(path)
    profile = make_profile(game, [[[3.0, 0.0]] * 4 + [[0.0, 0.0]]])
    assert between_steps_note(game, {"": profile}) == (
        "between steps 1 and 2 the means of agent_0 and obstacle 1 overlap by 0.7 "
        f"(and 1 other place); {LOOKS}"
    )


@pytest.mark.parametrize("collisions", ["instants", "swept"])
def test_a_drawn_plan_has_a_cross_at_each_place_and_a_legend(ppg, tmp_path, collisions):
    game = corridor(tmp_path / "game.toml", collisions, 4.0)
    plan = tmp_path / "plan.json"
    ppg("solve", game, "--solution", "social", "--out", plan)
    axes = new_figure(4.0, 4.0).subplots()
    draw_profile(axes, *read_plan(plan)[:2])
    crosses = [line for line in axes.lines if line.get_marker() == "X"]
    if collisions == "swept":
        assert crosses == []
        assert axes.get_legend() is None
        return
    (cross,) = crosses
    (place,) = json.loads(plan.read_text())["between_steps"]
    assert cross.get_xydata().tolist() == [place["place"]]
    (text,) = axes.get_legend().get_texts()
    assert text.get_text() == f"overlap between steps 1 and 2, by {place['depth']:.3g}"


def test_panels_have_a_cross_at_the_end_of_the_step_of_an_overlap(ppg, tmp_path, monkeypatch):
    plan = tmp_path / "plan.json"
    game = corridor(tmp_path / "game.toml", "instants", 4.0)
    ppg("solve", game, "--solution", "social", "--out", plan)
    figures = []
    monkeypatch.setattr(snapshots, "write_figure", lambda figure, path: figures.append(figure))
    snapshots.snapshots_picture(*read_plan(plan)[:2], [1, 2, 3], "unused.png")
    marked = [any(line.get_marker() == "X" for line in axes.lines) for axes in figures[0].axes]
    assert marked == [False, True, False]
    assert "overlap between steps 1 and 2, by " in figures[0].get_supxlabel()


def test_the_axis_of_crash_probabilities_names_the_event(ppg, narrow, tmp_path, monkeypatch):
    figures = []
    monkeypatch.setattr(pictures, "write_figure", lambda figure, path: figures.append(figure))
    ppg("compare", narrow, *FEW, "--out", tmp_path / "compare.png")
    labels = [axes.get_ylabel() for axes in figures[0].axes]
    assert "Pr(any overlap\nat the time steps)" in labels


def test_a_moving_obstacle_is_drawn_with_its_path_while_it_is_there():
    path = np.array([[0.0, -4.0], [0.0, -2.0], [0.0, 2.0], [0.0, 4.0]])
    agent = make_game("parallel").agents[0]
    game = Game((agent,), obstacles=(Obstacle(Polytope.box([1.0, 1.0]), path=path, until=3),))
    axes = new_figure(4.0, 4.0).subplots()
    draw_game(axes, game)
    assert path[:3].tolist() in [line.get_xydata().tolist() for line in axes.lines]


EVENTS = {"instants": "at the time steps", "swept": "during the steps"}


@pytest.mark.parametrize("collisions", first(1, EVENTS))
def test_tables_with_a_risk_say_which_overlaps_it_counts(ppg, tmp_path, collisions):
    game = corridor(tmp_path / "game.toml", collisions, 4.0)
    outputs = (
        ppg("solve", game, "--solution", "social"),
        ppg("compare", game, *FEW, "--out", tmp_path / "compare.png"),
        ppg("equilibria", game, "--runs", "1"),
    )
    (other,) = set(EVENTS) - {collisions}
    for done in outputs:
        notes = noted(done.out)
        assert len(notes) == (collisions == "instants")  # through each other is the short way
        table = "\n".join(line for line in done.out.splitlines() if line not in notes)
        assert f"overlap {EVENTS[collisions]}" in table
        assert EVENTS[other] not in table
        assert max(map(len, table.splitlines())) <= 124
