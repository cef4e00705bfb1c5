"""``ppg scenarios`` and ``ppg show``: what there is, and games as files."""

from __future__ import annotations

import sys

import pytest

from ppg_env import make_game
from tests.benchmarks.judges import timeless


def test_every_scenario_that_is_listed_can_be_shown(ppg):
    listed = ppg("scenarios", "--json").json["scenarios"]
    assert {"opposing", "head_on", "parallel", "intersection", "intersection3"} <= {
        entry["call"] for entry in listed
    }
    for entry in listed:
        assert entry["summary"]
        assert ppg("show", entry["call"], "--json").json["agent"]


def test_the_table_lists_the_same_scenarios(ppg):
    listed = ppg("scenarios", "--json").json["scenarios"]
    table = ppg("scenarios").out
    assert all(entry["call"].split("(")[0] in table for entry in listed)


def test_a_game_is_shown_with_its_overrides(ppg):
    options = ["--lam", "0.2,0.8", "--gain", "0.1", "--horizon", "20", "--margin-cap", "4"]
    options += ["--objective", "risk", "--crash-cost", "50", "--speed", "l1", "--noise", "2.5"]
    shown = ppg("show", "head_on", *options, "--json").json
    head, agents = shown["game"], shown["agent"]
    assert [agent["lam"] for agent in agents] == [0.2, 0.8]
    assert all(agent["gain"] == [[0.1, 0.0], [0.0, 0.1]] for agent in agents)
    assert all(agent["noise"] == [[2.5, 0.0], [0.0, 2.5]] for agent in agents)
    assert all(agent["control"] == {"l1": 10.0} for agent in agents)
    assert head["horizon"] == 20
    assert head["margin_cap"] == 4.0
    assert head["objective"] == "risk"
    assert head["crash_cost"] == 50.0


def test_options_say_what_counts_as_a_collision_and_what_an_agent_pays(ppg):
    options = ["--collisions", "swept", "--on-goal", "stay", "--reserve", "0.5", "--effort", "0,2"]
    shown = ppg("show", "head_on", *options, "--json").json
    assert (shown["game"]["collisions"], shown["game"]["on_goal"]) == ("swept", "stay")
    assert [agent["reserve"] for agent in shown["agent"]] == [0.5, 0.5]
    assert [agent.get("effort", 0.0) for agent in shown["agent"]] == [0.0, 2.0]
    table = ppg("show", "head_on", *options).out
    assert "collisions swept, on_goal stay" in table
    assert "agent_0: reserve 0.5\n" in table
    assert "agent_1: reserve 0.5; effort 2" in table


def test_large_games_are_shown_without_earliest_arrivals(ppg, monkeypatch):
    words = ("show", "circle(5)")  # 5 agents, horizon 15
    earliest = [line.split()[-2] for line in ppg(*words).out.splitlines() if "agent_" in line]
    assert earliest == ["8", "8", "7", "7", "8"]
    monkeypatch.setattr(sys.modules["benchmarks.commands.show"], "LARGEST", 5 * 15**2 - 1)
    shown = ppg(*words).out
    assert "earliest arrivals are not computed" in shown
    assert {line.split()[-2] for line in shown.splitlines() if "agent_" in line} == {"0.5"}


def test_a_solution_follows_the_options(ppg):
    def solved(*options):
        return ppg("solve", "head_on", "--solution", "social", *options, "--json").json

    plain, costly = solved(), solved("--effort", "0.1")
    efforts = [sum(abs(u) for row in rows for u in row) for rows in costly["controls"]]
    assert costly["shifted_cost"] == pytest.approx(
        [0.5 * t + d * 0.5 + 0.1 * e for t, d, e in
         zip(costly["arrival"], costly["deficit"], efforts, strict=True)], abs=1e-5
    )  # fmt: skip
    assert sum(costly["shifted_cost"]) > sum(plain["shifted_cost"]) + 10
    assert solved("--reserve", "1")["arrival"] >= [10, 10] > [9, 9] == plain["arrival"]
    assert solved("--collisions", "swept", "--on-goal", "stay")["status"] == "optimal"


MOVING = """
[game]
horizon = 12
on_goal = "stay"
[[agent]]
start = [0.0, 0.0]
goal = [40.0, 0.0]
shape = { box = [3.0, 3.0] }
control = { box = [20.0, 10.0] }
gain = 0.5
within = { low = [-5.0, -inf], high = [60.0, 9.0], sigmas = 1.0 }
[[obstacle]]
box = [2.0, 2.0]
path = [[10.0, 20.0], [10.0, 10.0]]
noise = 0.1
until = 8
[[obstacle]]
polygon = [[20, 20], [24, 20], [24, 21], [21, 21], [21, 24], [20, 24]]
"""


def test_a_file_without_the_rule_of_collisions_is_swept_and_written_so(ppg, tmp_path):
    file, copy = tmp_path / "moving.toml", tmp_path / "copy.toml"
    file.write_text(MOVING, encoding="utf-8")
    shown = ppg("show", file, "--out", copy).out
    assert "agent_0: within 3 half-spaces of positions, 1 sigma clear" in shown
    assert "moves from (10, 20) to (10, 10) by 1; noise 0.1 per step; gone from 8" in shown
    assert 'collisions = "swept"' in copy.read_text(encoding="utf-8")
    assert make_game(copy) == make_game(file)
    assert make_game(copy).collisions == "swept"
    assert len(make_game(copy).obstacles) == 3
    paper = tmp_path / "paper.toml"
    ppg("show", "head_on", "--out", paper)
    assert make_game(paper).collisions == "instants"


@pytest.mark.parametrize("name", ["intersection", "course", "circle(3)"])
def test_a_game_written_to_a_file_is_the_same_game(ppg, tmp_path, name):
    file = tmp_path / "game.toml"
    done = ppg("show", name, "--speed", "disc", "--objective", "risk", "--out", file)
    assert str(file) in done.err
    assert make_game(file) == make_game(name, speed="disc", objective="risk")
    assert ppg("show", file, "--json").json == (
        ppg("show", name, "--speed", "disc", "--objective", "risk", "--json").json
    )


def test_a_game_solved_from_its_file_has_the_same_solution(ppg, tmp_path):
    file = tmp_path / "game.toml"
    ppg("show", "head_on", "--lam", "0.7", "--out", file)
    words = ["--solution", "social", "--json"]
    from_file = timeless(ppg("solve", file, *words).json)
    direct = timeless(ppg("solve", "head_on", "--lam", "0.7", *words).json)
    assert from_file == direct


def test_the_table_tells_what_the_planner_needs_to_know(ppg):
    table = ppg("show", "head_on", "--horizon", "7").out
    assert "unreachable" in table
    assert "9" in ppg("show", "head_on").out


CHANGING = """
[[agent]]
start = [10.0, 50.0]
goal = [95.0, 50.0]
gain = 0.5
shape = { box = [15.0, 15.0] }
control = [{ box = [10.0, 10.0] }, { from = 5, l1 = 4.0 }]
"""


def test_a_file_whose_speed_set_changes_is_shown_written_and_solved(ppg, tmp_path):
    file, copy, plan = (tmp_path / name for name in ("game.toml", "copy.toml", "plan.json"))
    file.write_text(CHANGING)
    assert "box 10, from 5 l1 4" in " ".join(ppg("show", file, "--out", copy).out.split())
    assert make_game(copy) == make_game(file)
    control = ppg("show", file, "--json").json["agent"][0]["control"]
    assert control == [{"box": [10.0, 10.0]}, {"from": 5, "l1": 4.0}]
    solved = ppg(
        "solve", file, "--solution", "best-response", "--agent", "0", "--out", plan, "--json"
    )
    assert solved.json["arrival"] == [14]  # 50 in five steps, and 35 at 4 a step
    assert ppg("certify", plan, "--json").json["epsilon"] <= 1e-6
    assert ppg("show", file, "--speed", "l1", "--json").json["agent"][0]["control"] == {"l1": 10.0}


def test_the_arrival_region_is_shown(ppg):
    table = ppg("show", "head_on", "--speed", "l1").out
    head, row = (next(line for line in table.splitlines() if word in line).split()
                 for word in ("arrives within", "agent_0"))  # fmt: skip
    assert (head[-2:], row[-1]) == (["arrives", "within"], "5")
