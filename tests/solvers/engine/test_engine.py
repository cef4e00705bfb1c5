"""The engine cut short at any disjunction, and twice on the same game."""

from __future__ import annotations

import pytest

from ppg_env import evaluate, make_game
from ppg_env.game import objective
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver
from solvers.engine.arrival_search import engine_search
from solvers.engine.node_lp import TANGENT, Relaxation
from solvers.solution import Status
from tests.marks import first
from tests.oracles.mixed_games import mixed_game


class Steps(Budget):
    """A budget that runs out after a number of checks: an interruption that can be repeated."""

    def __init__(self, looks: int) -> None:
        super().__init__(None)
        self.looks = looks

    @property
    def out(self) -> bool:
        self.looks -= 1
        return self.looks < 0


@pytest.mark.parametrize("kind", first(1, ["margin", "risk"]))
def test_cut_short_anywhere_it_has_sound_plans_and_a_valid_bound(kind):
    game = make_game("intersection", speed="l1", objective=kind, lam=0.8, gain=0.0)
    weights = objective.social(game)
    optimum = engine_search(weights, (0, 1), None, Budget(None))
    assert optimum.status is Status.OPTIMAL
    seen = set()
    for looks in (0, 1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233):
        found = engine_search(weights, (0, 1), None, Steps(looks))
        seen.add(found.status)
        assert found.bound <= optimum.value + 1e-7
        if found.profile is None:
            assert found.status is Status.NO_INCUMBENT
        else:
            assert evaluate(game, found.profile).violations() == ()
            assert found.value >= optimum.value - 1e-7
    assert {Status.NO_INCUMBENT, Status.FEASIBLE} <= seen


def test_it_is_deterministic():
    game = make_game("intersection3", speed="l1", lam=0.8)
    one, two = (
        engine_search(objective.social(game), range(3), None, Budget(None)) for _ in range(2)
    )
    assert one.profile == two.profile
    assert one.bound == two.bound


def test_its_name_is_known_in_any_letters():
    assert check_solver("engine") == ENGINE
    assert check_solver("highs") == "HIGHS"


@pytest.mark.parametrize("seed", first(1, [9, 12, 36, 50]))
def test_tangents_that_are_dropped_change_no_optimum(seed, monkeypatch):
    weights = objective.social(mixed_game(seed, in_motion=True).game)
    rows = Relaxation._drop_tangents
    most = []

    def count(relaxation):
        rows(relaxation)
        most.append(sum(row == TANGENT for row in relaxation._rows))

    monkeypatch.setattr(Relaxation, "_drop_tangents", count)
    results, counts = [], []
    for limit in (10**9, 20):
        most.clear()
        monkeypatch.setattr("solvers.engine.node_lp.MOST_TANGENTS", limit)
        monkeypatch.setattr("solvers.engine.node_lp.MOST_AT_INSTANTS", limit)
        results.append(engine_search(weights, (0, 1), None, Budget(None)))
        counts.append(max(most))
    unlimited, limited = results
    assert limited.status is unlimited.status is Status.OPTIMAL
    assert limited.value == pytest.approx(unlimited.value, rel=1e-7, abs=1e-7)
    assert limited.bound == pytest.approx(unlimited.bound, rel=1e-7, abs=1e-7)
    assert counts[1] < counts[0]
