"""One factor at a time: levels differ from the base in one field, and have their names."""

from __future__ import annotations

import pytest

from benchmarks.studies import prices
from benchmarks.studies.sensitivity import data, study
from tests.benchmarks.studies.conftest import SMALL, crashing


def test_levels_change_one_factor_of_the_base():
    base, *others = data.levels(("l1", "disc", "box"))
    changed = [[name for name in base if level[name] != base[name]] for level in others]
    assert all(len(names) == 1 for names in changed)
    assert {name for names in changed for name in names} == set(data.FACTORS)
    assert len({str(level) for level in others}) == len(others)


def test_every_level_has_the_same_games():
    cells = data.cells(SMALL)
    per_level = len(SMALL.scenarios) * len(SMALL.lams) * len(prices.PLAYERS)
    assert len(cells) == per_level * len(data.levels(SMALL.speeds))
    assert len({cell.address for cell in cells}) == len(cells)


def level(cost, **changed):
    base = dict(zip(data.FACTORS, (3.0, 15, "exact", "l1"), strict=True)) | changed
    game = {"scenario": "head_on", "lam": 0.5, **base}
    return [
        crashing(0.1, 0.2, 0.3, player=player, social_cost=paid, **game)
        for player, paid in (("nash", cost), ("social", 1.0))
    ]


def test_levels_are_named_by_what_differs():
    rows = [*level(1.0), *level(1.1, margin_cap=8.0), *level(1.2, scale="paper")]
    found = data.by_level(rows, "nash")
    assert {name: [one.cost for one in some] for name, some in found.items()} == {
        "base": [1.0],
        "M' = 8": [1.1],
        "scale paper": [1.2],
    }
    said = " ".join(study.words(rows))
    assert "nash, mean cost gap: base 0.0%, M' = 8 10.0%, scale paper 20.0%." in said
    assert "base 0 / 0 of 1, M' = 8 0 / 0 of 1" in said
    assert "base 2.0e-01 / 2.0e-01" in said
    assert "potential, mean cost gap: no game." in said


@pytest.mark.slow
def test_ratios_of_a_level_are_those_of_its_rows(whole):
    """Sums of the agents' costs, straight from the store; without bounds on the paper's scale."""
    rows = whole(study.STUDY)
    found = data.by_level([study.STUDY.digest(row) for row in rows], "potential")
    assert list(found) == ["base", "M' = 2", "M' = 5", "M' = 8", "horizon 20", "scale paper"]
    paid = {
        (row.margin_cap, row.horizon, row.scale, row.player): sum(row.shifted_cost) for row in rows
    }
    for key, name in (((8.0, 15, "exact"), "M' = 8"), ((3.0, 15, "paper"), "scale paper")):
        (one,) = found[name]
        assert one.cost == pytest.approx(paid[(*key, "potential")] / paid[(*key, "social")])
    assert found["scale paper"][0].bound is None
    assert found["base"][0].bound is not None
