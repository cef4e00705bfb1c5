"""``ppg risk`` names the crash that it means, and follows the game's."""

from __future__ import annotations

import pytest

from ppg_env import evaluate
from ppg_env.formats.plan_file import read_plan

GAME = """
[game]
horizon = 12
objective = "risk"
on_goal = "stay"
collisions = "swept"
[[agent]]
start = [0.0, 40.0]
goal = [85.0, 40.0]
gain = 0.0
shape = { box = [15.0, 15.0] }
control = { box = [10.0, 10.0] }
noise = [[1.9, 0.0], [0.0, 1.9]]
[[agent]]
start = [85.0, 14.0]
goal = [0.0, 16.0]
gain = 0.0
shape = { box = [15.0, 15.0] }
control = { box = [10.0, 2.0] }
noise = [[1.9, 0.0], [0.0, 1.9]]
[[obstacle]]
box = [5.0, 5.0]
path = [[40.0, 80.0], [40.0, 74.0], [40.0, 70.0]]
noise = [[0.5, 0.0], [0.0, 0.5]]
"""

STEP, INSTANT = "overlap during a step", "overlap at a time step"


@pytest.fixture
def swept_plan(ppg, tmp_path):
    game, plan = tmp_path / "game.toml", tmp_path / "swept.json"
    game.write_text(GAME)
    ppg("solve", game, "--solution", "social", "--out", plan)
    return plan


def test_the_event_of_the_game_is_named_and_bounded(ppg, swept_plan):
    words = ["--episodes", "20000", "--json"]
    reports = {
        method: ppg("risk", swept_plan, "--method", method, *words).json
        for method in ("bound", "mc", "rare")
    }
    assert {report["event"] for report in reports.values()} == {STEP}
    game, profile, _ = read_plan(swept_plan)
    assert (game.collisions, game.on_goal) == ("swept", "stay")
    judged, bound = evaluate(game, profile), reports["bound"]
    assert bound["any"]["high"] == pytest.approx(judged.risk_bound_any)
    assert [one["high"] for one in bound["agents"]] == pytest.approx(judged.risk_bound)
    details = bound["details"]["bounds"]["any"]
    assert details["instants"] is details["ratios"]["instants"] is None
    assert details["least"] <= details["tree"] <= details["faces"] <= details["union"]
    assert details["faces"] == bound["any"]["high"]
    assert reports["mc"]["any"]["low"] <= details["tree"]
    assert 0 < reports["rare"]["any"]["low"] <= details["tree"]
    assert reports["rare"]["any"]["low"] <= reports["mc"]["any"]["high"]


def test_tables_name_the_event(ppg, swept_plan, plan_file):
    for plan, words, event in (
        (swept_plan, ["--method", "bound"], STEP),
        (swept_plan, ["--episodes", "2000"], STEP),
        (plan_file, ["--method", "exact"], INSTANT),
        (plan_file, ["--episodes", "2000"], INSTANT),
        (plan_file, ["--episodes", "2000", "--swept"], STEP),
    ):
        assert event in " ".join(ppg("risk", plan, *words).out.split())


def test_exact_is_refused_where_steps_count(ppg, swept_plan):
    done = ppg("risk", swept_plan, "--method", "exact", code=2)
    assert done.out == ""
    assert "time steps only" in done.err
    assert "bound, mc or rare" in done.err
    assert done.err.strip().count("\n") == 0


def test_instants_are_named_too(ppg, plan_file):
    words = ["risk", plan_file, "--json"]
    for method in ("bound", "exact", "mc", "rare"):
        report = ppg(*words, "--method", method, "--episodes", "2000").json
        assert report["event"] == INSTANT
    assert ppg(*words, "--episodes", "2000", "--swept").json["event"] == STEP
