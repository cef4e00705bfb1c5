"""Crash probabilities follow the game's own event: steps, parked bodies, moving obstacles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from ppg_env import Agent, Game, InputError, Polytope, evaluate, make_game, make_profile
from ppg_env.game import Obstacle
from ppg_env.game.margins import membership
from ppg_env.game.plan import Profile
from ppg_env.risk.batches import BLOCK, generator
from ppg_env.risk.crash_events import make_crash_model
from ppg_env.risk.importance_sampling import rare_risk
from ppg_env.risk.monte_carlo import crash_counts, paired_counts
from ppg_env.risk.union_bounds import risk_bounds
from tests.marks import first
from tests.oracles.slow_simulation import slow_crashes
from tests.ppg_env.strategies import Play, double_integrator, plays
from tests.profiles import examples

FAR = 4.5
"""Standard errors that fixed seeds must stay within: chance exceeds them once in 150,000."""

EVENTS = [(c, g) for c in ("instants", "swept") for g in ("remove", "stay")]


def parked(collisions: str, on_goal: str) -> tuple[Game, Profile]:
    """One agent parks early; two others, a double integrator too, go past it."""
    body, control = Polytope.box([4.0, 4.0]), Polytope.box([10.0, 10.0])
    A, B = double_integrator(2)
    gain = np.hstack([0.3 * np.eye(2), 0.8 * np.eye(2)])
    agents = (
        Agent([-8, 0], [0, 0], body, control, gain=0.3, noise=1.0, sigma0=0.5),
        Agent([-12, 6.5], [28, 6.5], Polytope.disc(2.5, 6), control, gain=0.1, noise=0.4),
        Agent([24, -8, -4, 0], [-8, -8], body, control, 0.5, gain, 0.05, A, B),
    )
    game = Game(agents, horizon=9, collisions=collisions, on_goal=on_goal)
    across = np.tile([8.0, 0.0], (9, 1))
    return game, make_profile(game, [across / 3, across * 0.625, np.zeros((9, 2))])


def driven(collisions: str, on_goal: str) -> tuple[Game, Profile]:
    """Two agents share a noisy obstacle that passes them and comes to rest; another one leaves."""
    body, control = Polytope.box([4.0, 4.0]), Polytope.box([10.0, 10.0])
    agents = (
        Agent([0, 0], [12, 0], body, control, gain=0.5, noise=0.5),
        Agent([0, 14], [18, 14], body, control, gain=0.0, noise=0.3),
    )
    path = np.column_stack([np.linspace(-16, 14, 6), np.full(6, 7.0)])
    shapes = Polytope.box([6.0, 4.0]), Polytope.from_vertices([[-2, -2], [2, -2], [0, 2]])
    obstacles = (
        Obstacle(shapes[0], path, 0.6 * np.eye(2)),
        Obstacle(shapes[1], [[6, -14], [6, -6.5], [6, -5.5]], 0.4, until=3),
    )
    game = Game(agents, obstacles, horizon=8, collisions=collisions, on_goal=on_goal)
    return game, make_profile(game, [np.tile([3.0, 0.0], (8, 1)), np.tile([3.0, 0.0], (8, 1))])


CASES = {"parked": parked, "driven": driven}


@pytest.mark.parametrize("name", first(1, CASES))
@pytest.mark.parametrize(("collisions", "on_goal"), EVENTS)
def test_counts_and_weights_agree_with_a_plain_simulation(
    name: str, collisions: str, on_goal: str
) -> None:
    game, profile = CASES[name](collisions, on_goal)
    samples = 20_000
    met = slow_crashes(game, profile, samples, seed=1)
    of_agents = np.array([met[own].any(axis=0).sum() for own in membership(game)])
    plain = np.array([*of_agents, *met.sum(axis=1), met.any(axis=0).sum()])
    counts = crash_counts(game, profile, samples, seed=2)
    hits = np.array([*counts.agents, *counts.encounters, counts.any])
    share = (plain + hits) / (2 * samples)
    error = np.sqrt(2 * samples * share * (1 - share))
    assert (np.abs(plain - hits) <= FAR * error + 4).all()
    assert counts.any > 200
    rare = rare_risk(game, profile, 20_000, seed=3)
    for one, mean in zip([*rare.agents, *rare.encounters, rare.any], share, strict=True):
        if one.trusted:
            slack = np.hypot(one.standard_error, np.sqrt(mean / (2 * samples)))
            assert abs(one.value - mean) <= FAR * slack + 1e-6
    assert rare.any.trusted


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(("collisions", "on_goal"), EVENTS)
def test_bounds_hold_and_are_ordered(name: str, collisions: str, on_goal: str) -> None:
    game, profile = CASES[name](collisions, on_goal)
    judged, bounds = evaluate(game, profile), risk_bounds(game, profile)
    each, any_agent = crash_counts(game, profile, 20_000, seed=4).estimates(1 - 1e-6)
    listed = [*judged.risk_bound, judged.risk_bound_any]
    sums = [*judged.risk_sum, judged.risk_sum_any]
    for one, most, total, counted in zip(
        (*bounds.agents, bounds.any), listed, sums, (*each, any_agent), strict=True
    ):
        assert one.least <= counted.high
        assert counted.low <= one.tree <= one.faces * (1 + 1e-12)
        assert one.faces <= most * (1 + 1e-9) <= total * (1 + 1e-9) + 1e-9
        assert (one.instants is None) == (collisions == "swept")


def test_a_parked_body_is_met_only_where_bodies_stay() -> None:
    game, profile = parked("instants", "stay")
    counts = crash_counts(game, profile, 20 * BLOCK, seed=5)
    gone = crash_counts(replace(game, on_goal="remove"), profile, 20 * BLOCK, seed=5)
    assert profile[0].arrival == 3
    assert (gone.times[:2, :3] == counts.times[:2, :3]).all()
    assert not gone.times[:2, 3:].any()
    assert counts.times[:2, 3:].sum() > 50


def test_a_parked_body_keeps_the_error_of_its_arrival() -> None:
    game, profile = parked("instants", "stay")
    processes = make_crash_model(game, profile).processes
    errors = processes.draw(generator(0), processes.scratch(8)(), True)
    assert processes.rests.tolist() == [3, 8, 8]
    assert (errors[3:, 0] == errors[3, 0]).all()
    assert (errors[2, 0] != errors[3, 0])[:2].all()
    spread = processes.covariances(8)
    np.testing.assert_array_equal(spread[3:, 0], np.broadcast_to(spread[3, 0], (6, 4, 4)))


@pytest.mark.parametrize("name", CASES)
def test_seeds_fix_the_counts_whatever_the_number_of_workers(name: str) -> None:
    flown = CASES[name]("swept", "stay")
    one, two = (crash_counts(*flown, 5 * BLOCK + 3, 1, workers=w) for w in (1, 3))
    assert (one.times == two.times).all()
    assert (crash_counts(*flown, 5 * BLOCK + 3, 2).times != one.times).any()
    assert rare_risk(*flown, 3000, 1, workers=2) == rare_risk(*flown, 3000, 1)


def test_the_default_is_the_games_event_and_the_other_can_be_asked_for() -> None:
    game = make_game("head_on", noise=4.0, speed="l1")
    rows = np.tile([[9.0, 1.0]], (15, 1))
    flown = make_profile(game, [rows, -rows])
    swept = replace(game, collisions="swept")
    by_game = [crash_counts(one, flown, 3000).any for one in (game, swept)]
    asked = [
        crash_counts(one, flown, 3000, swept=s).any for one, s in ((swept, False), (game, True))
    ]
    assert by_game == asked
    assert by_game[1] > by_game[0] > 0
    paired = paired_counts((swept, flown), (swept, flown), 3000, swept=(False, None))
    assert [paired.first.any, paired.second.any] == by_game


@examples(0.5)
@given(plays(scale="exact"), st.sampled_from(["remove", "stay"]), st.booleans(), st.integers(0, 99))
def test_random_games_never_refute_the_bounds(
    play: Play, on_goal: str, moving: bool, seed: int
) -> None:
    """Swept Monte Carlo against the bounds; and instants, which are part of the steps."""
    walls = play.game.obstacles
    if moving:
        path = np.array([[0.0, 0.0], [-6.0, -8.0], [2.0, -12.0]])
        walls = tuple(Obstacle(wall.shape, path, 0.5, until=4) for wall in walls)
    try:
        game = replace(play.game, obstacles=walls, collisions="swept", on_goal=on_goal)
    except InputError:  # parked bodies overlap
        assume(False)
    profile = make_profile(game, play.controls)
    judged = evaluate(game, profile)
    counts = paired_counts((game, profile), (game, profile), 2000, seed, swept=(None, False))
    each, any_agent = counts.first.estimates(1 - 1e-6)
    bounds = risk_bounds(game, profile)
    for estimate, bound, total, one in zip(
        (*each, any_agent),
        (*judged.risk_bound, judged.risk_bound_any),
        (*judged.risk_sum, judged.risk_sum_any),
        (*bounds.agents, bounds.any),
        strict=True,
    ):
        assert estimate.low <= min(bound, one.tree)
        assert bound <= total * (1 + 1e-9)
        assert one.least <= estimate.high
    assert (counts.second.agents <= counts.first.agents).all()


@examples(0.3)
@given(plays(scale="exact"), st.permutations([0, 1, 2]))
def test_the_bound_does_not_depend_on_the_order_of_agents(play: Play, order: list[int]) -> None:
    game = replace(play.game, collisions="swept")
    order = [i for i in order if i < len(game.agents)]
    turned = replace(game, agents=tuple(game.agents[i] for i in order))
    one = evaluate(game, make_profile(game, play.controls))
    two = evaluate(turned, make_profile(turned, [play.controls[i] for i in order]))
    np.testing.assert_allclose(two.risk_bound, one.risk_bound[order], rtol=1e-6)
    assert two.risk_bound_any == pytest.approx(one.risk_bound_any, rel=1e-6)
