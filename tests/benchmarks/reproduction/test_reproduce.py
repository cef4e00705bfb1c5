"""``ppg reproduce`` from nothing: the same numbers as the planners and the evaluator give."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.reproduction.extent import (
    BEST_RESPONSE,
    DYNAMICS,
    SOCIAL,
    SOLUTIONS,
    Extent,
    Place,
    Setting,
    read_settings,
)
from benchmarks.reproduction.run import report, reproduce
from ppg_env import evaluate, make_game
from ppg_env.errors import InputError
from solvers import best_response_dynamics, certify, social_optimum

SETTING = Setting("l1", 3.0)
SMALL = Extent((SETTING,), ("head_on", "intersection"), (0.5,), (0.3, 0.8), episodes=500)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return reproduce(SMALL, tmp_path_factory.mktemp("store") / "cells.db")


def test_every_panel_has_all_solutions_over_all_lam(found):
    assert set(found.panels) == {Place(SETTING, s, 0.5) for s in SMALL.scenarios}
    for panel in found.panels.values():
        assert set(panel.curves) == set(SOLUTIONS)
        assert all(curve.time.shape == (2, 2) for curve in panel.curves.values())
    assert not found.failed
    assert SMALL.size == 2 * len(SOLUTIONS) * 2


def test_curves_are_what_the_evaluator_says_of_the_plans(found):
    for place, panel in found.panels.items():
        for k, lam in enumerate(SMALL.lams):
            game = make_game(place.scenario, speed="l1", margin_cap=3.0, gain=0.5, lam=lam)
            nash = best_response_dynamics(game, start="straight")
            social = social_optimum(game)
            for name, solution in ((BEST_RESPONSE, nash), (SOCIAL, social)):
                judged = evaluate(game, solution.profile)
                curve = panel.curves[name]
                np.testing.assert_allclose(curve.objective[k], judged.shifted_cost)
                np.testing.assert_allclose(curve.time[k], judged.arrival)
                np.testing.assert_allclose(curve.safety[k], judged.deficit, atol=1e-9)
                assert curve.risk_bound[k] == pytest.approx(judged.risk_bound_any)


def test_equilibria_are_certified_by_a_fresh_solve(found):
    for place, panel in found.panels.items():
        for name in DYNAMICS:
            row = panel.plans[name][1]
            game = make_game(place.scenario, speed="l1", margin_cap=3.0, gain=0.5, lam=0.8)
            profile = [np.array(one) for one in row.controls]
            assert certify(game, _profile(game, profile)).epsilon <= 1e-4


def _profile(game, controls):
    from ppg_env.game.plan import make_profile

    return make_profile(game, controls)


def test_the_band_spans_all_equilibria(found):
    for panel in found.panels.values():
        low, high = panel.band("objective")
        for name in (*DYNAMICS, "potential"):
            mean = panel.curves[name].mean("objective")
            assert (low <= mean + 1e-12).all()
            assert (mean <= high + 1e-12).all()


@pytest.mark.slow
def test_a_second_run_reads_the_store_and_says_the_same(found, tmp_path):
    store = tmp_path / "cells.db"
    counts = []
    first = reproduce(SMALL, store)
    second = reproduce(SMALL, store, progress=counts.append)
    assert counts == [
        len({c.address for p in SMALL.places() for s in SMALL.cells(p).values() for c in s})
    ]
    assert str(report(first)) == str(report(second)) == str(report(found))


@pytest.mark.slow
def test_bodies_can_be_asked_to_keep_apart_between_steps(found, tmp_path):
    swept = reproduce(replace(SMALL, collisions="swept"), tmp_path / "swept.db")
    assert report(swept)["collisions"] == "swept"
    assert report(found)["collisions"] == "instants"
    assert not swept.failed
    for place, panel in swept.panels.items():
        for rows in panel.plans.values():
            assert {row.collisions for row in rows} == {"swept"}
        optimum = panel.social.mean("objective")
        # The optimum keeps apart during steps, and a margin of a step is that of its worse end.
        assert (optimum >= found.panels[place].social.mean("objective") - 1e-6).all()


def test_another_rule_of_collisions_is_refused(tmp_path):
    with pytest.raises(InputError, match="'instants' or 'swept'"):
        reproduce(replace(SMALL, collisions="often"), tmp_path / "cells.db")


@pytest.mark.parametrize("text", ["box", "box:", "box:three", ":"])
def test_settings_are_read_strictly(text):
    with pytest.raises(InputError, match="box:3,l1:8"):
        read_settings(text)


@pytest.mark.parametrize(
    "extent",
    [{"scenarios": ("circle(4)",)}, {"lams": (1.0,)}, {"lams": (0.5, 0.5)}, {"settings": ()}],
)
def test_an_extent_that_makes_no_sense_is_refused(extent):
    with pytest.raises(InputError):
        Extent(**extent)
