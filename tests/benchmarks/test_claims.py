"""What ``ppg certify`` and ``ppg render`` say of a plan file that claims what is not so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ppg_env.formats.plan_file import read_plan
from tests.marks import first


def changed(plan_file: Path, tmp_path: Path, **entries: object) -> Path:
    path = tmp_path / "changed.json"
    path.write_text(json.dumps(json.loads(plan_file.read_text()) | entries))
    return path


def test_an_honest_file_is_not_mentioned(ppg, plan_file, tmp_path):
    assert ppg("certify", plan_file, "--json").json["different_claims"] == []
    assert "claims" not in ppg("render", plan_file, "--out", tmp_path / "plan.png").out


@pytest.mark.parametrize(
    "claim", first(1, [{"social_cost": 1.0}, {"arrival": [1, None]}, {"cost": "low"}])
)
def test_a_claim_that_differs_is_named(ppg, plan_file, tmp_path, claim):
    file = changed(plan_file, tmp_path, **claim)
    (entry,) = claim
    (found,) = ppg("certify", file, "--json").json["different_claims"]
    assert found["entry"] == entry
    assert found["claimed"] == claim[entry]
    line = f"the file claims {entry} "
    assert line in ppg("certify", file).out
    assert line in ppg("render", file, "--out", tmp_path / "plan.svg").out


def test_what_is_not_possible_in_a_plan_is_said(ppg, plan_file, tmp_path):
    game, profile, _ = read_plan(plan_file)
    still = [(0 * plan.controls).tolist() for plan in profile]
    file = changed(plan_file, tmp_path, controls=still)
    picture = tmp_path / "plan.svg"
    out = ppg("render", file, "--out", picture).out
    assert f"not possible: the mean of {game.agent_names[0]} misses its goal" in out
    report = ppg("render", file, "--out", picture, "--json").json
    assert len(report["complaints"]) >= 2
