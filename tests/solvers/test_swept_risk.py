"""The risk bound of plans that keep apart between the steps, on the paper's scenarios."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from shapely.affinity import translate
from shapely.geometry import MultiPoint

from ppg_env import Game, Profile, evaluate, make_game
from ppg_env.risk.importance_sampling import rare_risk
from ppg_env.risk.monte_carlo import crash_counts
from ppg_env.risk.union_bounds import risk_bounds
from solvers import potential_equilibrium, social_optimum
from tests.marks import first

SCENARIOS = ("opposing", "head_on", "parallel", "intersection", "intersection3")
CASES = list(product(SCENARIOS, ["box", "l1"], [0.0, 0.5], [0.5, 0.8], ["social", "nash"]))
QUICK = [
    ("head_on", "l1", 0.0, 0.5, "nash"),
    ("intersection", "l1", 0.0, 0.8, "nash"),
    ("parallel", "box", 0.0, 0.8, "social"),
]
TIGHT = 4.0
"""Largest ratio of the bound to the probability, where that is above ``COUNTED``."""

COUNTED = 1e-6

SURE = 1 - 1e-4
"""Confidence of comparisons; seeds are fixed, so they hold once and for all."""


def planned(name: str, speed: str, gain: float, lam: float, kind: str) -> tuple[Game, Profile]:
    game = make_game(name, speed=speed, gain=gain, lam=lam, objective="risk", collisions="swept")
    solution = (social_optimum if kind == "social" else potential_equilibrium)(game)
    assert solution.profile is not None
    return game, solution.profile


def judge(game: Game, profile: Profile, samples: int) -> float:
    """Assert all that must hold; return the bound over the probability, 1 if that is too small."""
    judged, bounds = evaluate(game, profile), risk_bounds(game, profile)
    assert judged.feasible
    counts = crash_counts(game, profile, samples, seed=1)
    each, any_agent = counts.estimates(SURE)
    for estimate, bound, total in zip(
        (*each, any_agent),
        (*judged.risk_bound, judged.risk_bound_any),
        (*judged.risk_sum, judged.risk_sum_any),
        strict=True,
    ):
        assert estimate.low <= bound <= total * (1 + 1e-9)
    assert any_agent.low <= bounds.any.tree <= bounds.any.faces
    instants = crash_counts(game, profile, samples, seed=1, swept=False)
    assert instants.estimates(SURE)[1].low <= judged.risk_bound_any
    rare = rare_risk(game, profile, 50_000, confidence=SURE).any
    assert rare.trusted
    assert any_agent.low <= rare.high
    assert rare.low <= any_agent.high
    return judged.risk_bound_any / rare.value if rare.value > COUNTED else 1.0


@pytest.mark.parametrize("case", first(1, QUICK), ids=str)
def test_the_bound_holds_and_is_tight_where_crashes_can_be_counted(case: tuple) -> None:
    assert 1.0 < judge(*planned(*case), 200_000) <= TIGHT


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_million_episodes_never_refute_the_bound(case: tuple) -> None:
    assert judge(*planned(*case), 1_000_000) <= TIGHT


@pytest.mark.parametrize("case", first(1, QUICK), ids=str)
def test_accepted_means_do_not_overlap_at_a_thousand_points_of_any_step(case: tuple) -> None:
    game, profile = planned(*case)
    assert evaluate(game, profile).feasible
    hulls = [MultiPoint(agent.shape.vertices).convex_hull for agent in game.agents]
    share = np.linspace(0.0, 1.0, 1000)[:, None]
    for e in game.encounters:
        i, j = e.agents
        for t in range(min(profile[i].arrival, profile[j].arrival)):
            first, second = (
                (1 - share) * profile[k].means[t, :2] + share * profile[k].means[t + 1, :2]
                for k in (i, j)
            )
            for gap in second - first:
                moved = translate(hulls[j], *gap)
                assert not hulls[i].intersects(moved) or hulls[i].intersection(moved).area < 1e-4
