"""``ppg risk --explain``: the likeliest crash in words, as JSON and as a picture."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from ppg_env.formats.plan_file import read_plan
from ppg_env.risk.likeliest_crash import likeliest_crash


def test_the_likeliest_crash_is_printed_reported_and_drawn(ppg, plan_file, tmp_path):
    picture = tmp_path / "crash.svg"
    words = ["risk", plan_file, "--method", "exact", "--explain"]
    text = ppg(*words, "--out", picture).out
    assert picture.read_text().startswith("<?xml")
    report = ppg(*words, "--json").json
    crash, truth = report["likeliest_crash"], likeliest_crash(*read_plan(plan_file)[:2])
    assert truth is not None
    assert crash["agents"] == [0, 1]
    assert crash["form"] == pytest.approx(norm.sf(crash["beta"]))
    assert crash["probability"] <= crash["form"] * (1 + 1e-6)
    assert crash["any"] == [report["any"]["low"], report["any"]["high"]]
    np.testing.assert_array_equal(crash["deviations"], np.array(truth.deviations))
    assert f"agent_0 and agent_1 at t = {truth.time}" in text
    assert f"beta {truth.beta:.4g}" in text


def test_with_swept_no_exact_probability_is_claimed(ppg, plan_file):
    words = ["risk", plan_file, "--method", "rare", "--episodes", "2000", "--swept", "--explain"]
    crash = ppg(*words, "--json").json["likeliest_crash"]
    assert crash["probability"] is None
    assert 0.0 < crash["share"] <= 1.0
    assert f"t = {crash['time']}, through" in ppg(*words).out


def test_players_without_plans_and_pictures_without_a_crash_are_refused(ppg, plan_file):
    assert "add --explain" in ppg("risk", plan_file, "--out", "crash.png", code=2).err
    learned = ["--player", "ppo-social", "--speed", "l1", "--episodes", "10", "--explain"]
    assert "is for plans" in ppg("risk", "intersection", *learned, code=2).err
