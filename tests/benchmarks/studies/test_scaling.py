"""Scaling: sizes, tables and sentences; missing optima leave holes, not numbers."""

from __future__ import annotations

import pytest

from benchmarks.studies.scaling import data, study
from benchmarks.studies.study import StudyChoice
from tests.benchmarks.studies.conftest import SMALL, crashing


def row(agents, player, seconds, cost=10.0, risk=0.1, **others):
    game = {"scenario": f"circle({agents})", "family": "circle", "agents": agents, "horizon": 15}
    known = {"speed": "box", "lam": 0.8, "player": player, "machine": "abacus", "gap": 0.25}
    found = {"seconds": seconds, "social_cost": cost, "status": "equilibrium", "regret": 1e-7}
    return crashing(0.9 * risk, risk, 1.1 * risk, **game | known | found | others)


def test_families_grow_in_agents_and_one_game_in_its_horizon():
    cells = data.cells(SMALL)
    assert [c.game.horizon for c in cells if c.player == "nash"] == list(data.HORIZONS)
    circles = data.cells(StudyChoice(("circle",), ("box",), (0.8,), 100))
    assert [len(c.game.agents) for c in circles if c.player == "nash"] == list(data.SIZES)
    assert all(c.time_limit == data.LIMIT for c in cells + circles)


@pytest.mark.slow
def test_rows_have_their_seconds_and_their_machine(whole):
    for stored in whole(study.STUDY):
        known = data.digest(stored)
        assert known["family"] == data.LONG
        assert data.size_of(known) == stored.horizon
        assert 0 < known["seconds"] < data.LIMIT
        assert "processors" in known["machine"]


def test_planners_are_reported_up_to_the_largest_game_that_they_finished():
    rows = [
        row(2, "nash", 0.1, risk=0.5),
        row(2, "social", 0.5, cost=8.0, risk=0.1, status="optimal"),
        row(6, "nash", 20.0),
        row(6, "social", data.LIMIT + 1, cost=12.5, status="feasible"),
        row(8, "nash", data.LIMIT + 1, status="limit"),
        {"scenario": "circle(8)", "player": "social", "reason": "out of time"},
    ]
    (table,) = study.tables(rows)
    two, six, eight = table.lines
    assert two[4:7] == ("0.5", "25.0%", "1.250")
    assert two[-1] == "5"
    assert six[6] == "0.800"
    assert six[-1] == "(1)"
    assert eight[3:] == ("1e-07", "-", "-", "-", "1.0e-1", "-", "-")
    assert "abacus" in table.note
    said = " ".join(study.words(rows))
    assert "nash finished within 30 s up to N = 6, where it took 20 s" in said
    assert "social finished within 30 s up to N = 2, where it took 0.5 s" in said
    assert "2 of 3 runs of the dynamics ended at a certified equilibrium" in said
    assert "the optimum is proved up to N = 2" in said
    assert "best known plans, in 1 of 2 games, safer in 0; cost ratios are 0.800 to 1.250" in said
    assert "1 plans are missing" in said
