"""``ppg bench``: it runs, and says what it measured against what."""

from __future__ import annotations

import pytest


def test_a_quick_run_measures_everything_once(ppg):
    measured = ppg("bench", "--quick", "--json").json["measurements"]
    for row in measured:
        assert row["what"]
        assert row["value"] > 0
        assert row["target"] > 0
    text = " ".join(row["what"] for row in measured)
    for part in ("best response", "social optimum", "episodes", "import ppg_env", "ppg --help"):
        assert part in text


def test_first_plans_and_proofs_among_walls_are_measured(ppg):
    rows = ppg("bench", "walls", "--quick", "--json").json["measurements"]
    first, proof = rows
    assert first["what"].endswith("first plans, s")
    assert proof["what"].endswith("proof, s")
    assert 0 < first["value"] <= proof["value"]


@pytest.mark.slow
def test_training_is_measured(ppg):
    rows = ppg("bench", "learning", "--quick", "--json").json["measurements"]
    text = " ".join(row["what"] for row in rows)
    assert "steps per second" in text
    assert "share" in text
    assert all(row["value"] > 0 for row in rows)


@pytest.mark.slow
def test_sweeps_are_measured(ppg):
    rows = ppg("bench", "sweep", "--quick", "--json").json["measurements"]
    text = " ".join(row["what"] for row in rows)
    assert "commit a row" in text
    assert "two workers" in text
    assert all(row["value"] > 0 for row in rows)


@pytest.mark.slow
def test_the_engine_is_measured_against_highs(ppg):
    rows = ppg("bench", "engine", "--quick", "--json").json["measurements"]
    text = " ".join(row["what"] for row in rows)
    assert "median ms" in text
    assert "HIGHS / engine" in text
    assert all(row["value"] > 0 for row in rows)


@pytest.mark.slow
def test_crash_probabilities_are_timed(ppg):
    rows = ppg("bench", "risk", "--quick", "--json").json["measurements"]
    text = " ".join(row["what"] for row in rows)
    for part in ("exact, a plan of two agents", "rate of drawing", "rare at 1e-9", "splitting"):
        assert part in text
    assert all(row["value"] > 0 for row in rows)


@pytest.mark.nightly
@pytest.mark.slow
def test_feedback_policies_are_measured(ppg):
    rows = ppg("bench", "feedback", "--quick", "--json").json["measurements"]
    text = " ".join(row["what"] for row in rows)
    for part in ("best response to a learned player", "feedback optimum", "decisions per second"):
        assert part in text
    assert all(row["value"] > 0 for row in rows if "gain" not in row["what"])
