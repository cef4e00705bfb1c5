"""``ppg export``: a plan's trajectories as CSV."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from ppg_env.env.episodes import trajectories
from ppg_env.env.players import Tracker
from ppg_env.formats.csv_text import csv_text
from ppg_env.formats.plan_file import read_plan


def read(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def test_means_and_controls_are_exact(ppg, plan_file, tmp_path):
    out = tmp_path / "plan.csv"
    assert "rows" in ppg("export", plan_file, "--out", out).err
    game, profile, _ = read_plan(plan_file)
    rows = read(out)
    assert len(rows) == len(game.agents) * (game.horizon + 1)
    for name, plan in zip(game.agent_names, profile, strict=True):
        own = [row for row in rows if row["agent"] == name]
        assert [[float(row["x0"]), float(row["x1"])] for row in own] == plan.means.tolist()
        steps = [[float(row["u0"]), float(row["u1"])] for row in own[:-1]]
        assert steps == plan.controls.tolist()
        assert own[-1]["u0"] == ""
        assert [row["arrived"] for row in own].index("1") == plan.arrival


def test_episodes_are_those_of_the_simulator(ppg, plan_file, tmp_path):
    out = tmp_path / "episodes.csv"
    ppg("export", plan_file, "--episodes", 3, "--seed", 5, "--out", out)
    game, profile, _ = read_plan(plan_file)
    players = [Tracker(game, i, plan) for i, plan in enumerate(profile)]
    states = trajectories(game, players, 3, 5)
    rows = read(out)
    assert len(rows) == int(np.isfinite(states[..., 0]).sum())
    for row in rows:
        i = game.agent_names.index(row["agent"])
        state = states[int(row["episode"]), int(row["time"]), i]
        assert [float(row["x0"]), float(row["x1"])] == state.tolist()


def test_bad_requests_are_refused(ppg, plan_file, tmp_path):
    assert "name a .csv file" in ppg("export", plan_file, "--out", "x.txt", code=2).err
    words = ("--episodes", 10**9, "--out", tmp_path / "x.csv")
    assert "ask for 1 to" in ppg("export", plan_file, *words, code=2).err


@pytest.mark.parametrize("text", ["=cmd()", "@a", "+1", "-1"])
def test_text_is_no_formula(text):
    assert csv_text(["name"], [[text], [None], [-1.5]]) == f'name\n\'{text}\n""\n-1.5\n'
