"""Every claim can hold and can fail: panels made for the purpose show both."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.reproduction.claims import CLAIMS
from benchmarks.reproduction.curves import Curve, Panel
from benchmarks.reproduction.extent import (
    EQUILIBRIA,
    GAINS,
    SCENARIOS,
    SOCIAL,
    Place,
    Setting,
)

LAMS = np.array([0.2, 0.4, 0.6, 0.8])
LOW, HIGH = LAMS <= 0.5, LAMS > 0.5
SETTING = Setting("l1", 3.0)


def curve(objective=0.0, time=0.0, safety=0.0, crash=0.0, regret=0.0, status="equilibrium"):
    """Two agents alike; numbers are added to a base, one for each lam or one for all."""

    def column(base, extra):
        return np.repeat((base + extra + 0 * LAMS)[:, None], 2, axis=1)

    rate = 0.1 + crash + 0 * LAMS
    return Curve(
        column(10.0, objective),
        column(9.0, time),
        column(5.0, safety),
        np.stack([rate, rate - 0.01, rate + 0.01], axis=1),
        rate,
        0 * LAMS + regret,
        (status,) * len(LAMS),
        ("",) * len(LAMS),
    )


def panels(equilibrium):
    """All panels of a setting; ``equilibrium`` makes the curve of a place."""
    found = {}
    for scenario in SCENARIOS:
        for gain in GAINS:
            place = Place(SETTING, scenario, gain)
            selfish = equilibrium(place)
            curves = dict.fromkeys(EQUILIBRIA, selfish) | {SOCIAL: curve()}
            found[place] = Panel(place, LAMS, curves, {})
    return found


def crossing(place):
    return place.scenario.startswith("intersection")


EXAMPLES = {
    "small objective gap": (lambda p: curve(objective=0.9), lambda p: curve(objective=1.1)),
    "equilibria are faster": (lambda p: curve(time=-1.0), lambda p: curve(time=0.0)),
    "safety is compromised": (lambda p: curve(safety=1.0), lambda p: curve(safety=-1.0)),
    "more collisions": (lambda p: curve(crash=0.03), lambda p: curve(crash=0.015)),
    "gap grows with care": (
        lambda p: curve(safety=np.where(LOW, 2.0, 1.0)),
        lambda p: curve(safety=np.where(LOW, 1.0, 2.0)),
    ),
    "dramatic in the first two": (
        lambda p: curve(safety=1.0 if crossing(p) else 2.0),
        lambda p: curve(safety=2.0 if crossing(p) else 1.0),
    ),
    "elsewhere at high lam": (
        lambda p: curve(safety=np.where(LOW, 1.0, 2.0)),
        lambda p: curve(safety=1.0),
    ),
    "feedback helps": (
        lambda p: curve(safety=1.0 if p.gain else 2.0),
        lambda p: curve(safety=2.0 if p.gain else 1.0),
    ),
    "feedback helps at intersections": (
        lambda p: curve(safety=1.0 if p.gain else 2.0),
        lambda p: curve(safety=1.0),
    ),
    "except at high lam": (
        lambda p: curve(safety=np.where(HIGH, 2.0 if p.gain else 1.0, 1.0)),
        lambda p: curve(safety=1.0 if p.gain else 2.0),
    ),
    "best response converges": (lambda p: curve(regret=1e-6), lambda p: curve(regret=1e-3)),
}


def claim(key):
    return next(one for one in CLAIMS if one.key == key)


@pytest.mark.parametrize("key", EXAMPLES)
def test_a_claim_holds_where_it_is_true_and_fails_where_it_is_not(key):
    for equilibrium, holds in zip(EXAMPLES[key], (True, False), strict=True):
        cases = list(claim(key).cases(panels(equilibrium)))
        assert cases
        assert {case.holds for case in cases} == {holds}
        assert all(case.evidence for case in cases)


def test_agents_alike_bear_the_average_out_and_opposite_ones_do_not():
    key = "same for each agent"
    assert all(case.holds for case in claim(key).cases(panels(lambda p: curve(time=-1.0))))
    uneven = curve(time=-1.0)
    uneven.time[:, 0] += 3.0  # slower than at the optimum, while the average
    uneven.time[:, 1] -= 4.0  # is faster
    assert not any(case.holds for case in claim(key).cases(panels(lambda p: uneven)))


def test_every_claim_has_an_example():
    assert {one.key for one in CLAIMS} == {*EXAMPLES, "same for each agent"}


def test_cells_without_a_result_are_left_out():
    gappy = curve(time=-1.0)
    for values in (gappy.objective, gappy.time, gappy.safety, gappy.crash):
        values[LOW] = np.nan
    cases = list(claim("equilibria are faster").cases(panels(lambda p: gappy)))
    assert {case.factors["lam"] for case in cases} == {"high"}
    assert all(case.holds for case in cases)
