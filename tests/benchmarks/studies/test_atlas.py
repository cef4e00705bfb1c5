"""The atlas: orders, names of equilibria, basins."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from benchmarks.studies.atlas import data, study
from benchmarks.studies.study import StudyChoice
from tests.benchmarks.studies.conftest import SMALL, crashing


def row(kind, cost, start="straight", risk=0.1, status="equilibrium"):
    known = {"scenario": "toy", "speed": "l1", "lam": 0.5, "agents": 2, "start": start}
    ended = {"kind": kind, "social_cost": cost, "status": status, "regret": 1e-9}
    return crashing(0.9 * risk, risk, 1.1 * risk, **known | ended)


def test_few_agents_move_in_all_orders_and_many_in_some():
    for scenario, fixed in (("intersection", 2), ("intersection3", 6), ("circle(4)", 6)):
        cells = data.cells(StudyChoice((scenario,), ("l1",), (0.8,), 100))
        assert len({cell.address for cell in cells}) == 2 * (fixed + data.RANDOM)
        orders = {cell.order for cell in cells if cell.order != "random"}
        assert len(orders) == fixed
        assert orders <= set(permutations(range(len(cells[0].game.agents))))


@pytest.mark.slow
def test_names_follow_from_the_plans_in_the_rows(whole):
    rows = whole(study.STUDY)
    known = [data.digest(stored) for stored in rows]
    assert {one["kind"] for one in known} == {"0<1 left", "0<1 right"}
    for stored, one in zip(rows, known, strict=True):
        assert one["status"] == "equilibrium"
        assert one["regret"] <= 1e-5
        # Where the two are nearest, agent 0 moves to the left or right of agent 1's eyes.
        apart = np.subtract(*stored.means)[: min(stored.arrival)]
        nearest = int(np.linalg.norm(apart, axis=1)[:-1].argmin())
        (x, y), (u, v) = apart[nearest], apart[nearest + 1] - apart[nearest]
        assert one["kind"] == f"0<1 {'left' if x * v - y * u > 0 else 'right'}"
    (game,) = data.games(known)
    assert sum(kind.share(game.runs) for kind in game.kinds) == pytest.approx(1)
    assert len(game.runs) == len(data.cells(SMALL))


def test_basins_are_shares_of_all_runs_or_of_those_with_one_start():
    rows = [
        *(row("left", cost) for cost in (10.0, 10.001, 10.5)),
        row("left", 10.0, "sequential"),
        *(row("right", 11.0, "sequential", risk=0.9) for _ in range(3)),
        row("right", 9.0, status="limit"),
    ]
    (game,) = data.games(rows)
    left, right = game.kinds
    assert (left.name, right.name) == ("left", "right")
    assert left.share(rows) == 0.5
    assert left.share(rows, "straight") == 3 / 4
    assert right.share(rows, "sequential") == 3 / 4
    assert [one["social_cost"] for one in left.distinct] == [10.0, 10.5]
    assert [one["social_cost"] for one in game.equilibria] == [10.0, 10.5, 11.0]
    said = " ".join(study.words(rows))
    assert "3 equilibria of 2 kinds, distinct in cost or kind" in said
    assert "the costliest is 10.00% above the cheapest" in said
    assert "crash probabilities from 1.0e-1 to 9.0e-1, at least 7.4 times as likely" in said
    assert "most frequent kind is left, from 50% of the runs; 38% end at the least cost" in said
    assert "did not end at a certified equilibrium: 1 of 8" in said
