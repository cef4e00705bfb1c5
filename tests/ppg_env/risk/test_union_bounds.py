"""Bounds on the crash probability of plans: their order, and what they bound."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtr
from scipy.stats import multivariate_normal

from ppg_env import Agent, Game, Polytope, evaluate, make_game, make_profile
from ppg_env.game.plan import Profile
from ppg_env.risk.monte_carlo import crash_counts
from ppg_env.risk.union_bounds import Bounds, risk_bounds
from tests.marks import first
from tests.ppg_env.risk.test_monte_carlo import DELAYS, close_pair, straight
from tests.ppg_env.strategies import Play, double_integrator, plays
from tests.profiles import examples

ORDER = ("union", "faces", "instants", "tree", "least")


def assert_ordered(bounds: Bounds) -> None:
    values = [getattr(bounds, name) for name in ORDER]
    for above, below in pairwise(values):
        assert below <= above * (1 + 1e-12)
    assert all(0 <= value <= 1 for value in values)


def assert_counted(game: Game, profile: Profile, samples: int, seed: int) -> None:
    """Order of all bounds, with simulation between the last two."""
    found = risk_bounds(game, profile)
    each, any_agent = crash_counts(game, profile, samples, seed).estimates(1 - 1e-6)
    for bounds, counted in zip((*found.agents, found.any), (*each, any_agent), strict=True):
        assert_ordered(bounds)
        assert counted.low <= bounds.tree
        assert bounds.least <= counted.high
    for bounds in found.encounters:
        assert_ordered(bounds)


@given(plays(), st.integers(0, 100))
def test_the_order_holds_for_random_games(play: Play, seed: int) -> None:
    assert_counted(play.game, play.profile, 3000, seed)


@pytest.mark.parametrize("speed", ["box", "disc"])
@pytest.mark.parametrize("noise", first(1, [8.0, 1.9]))
@pytest.mark.parametrize("gain", [0.0, 0.5])
@pytest.mark.parametrize("name", DELAYS)
def test_the_order_holds_in_the_papers_scenarios(
    name: str, gain: float, noise: float, speed: str
) -> None:
    game = make_game(name, speed=speed, noise=noise, gain=gain, horizon=40)
    assert_counted(game, straight(game, DELAYS[name]), 20_000, seed=3)


@given(plays(scale="exact"))
def test_the_first_bound_is_the_evaluators(play: Play) -> None:
    found, judged = risk_bounds(play.game, play.profile), evaluate(play.game, play.profile)
    expected = np.minimum([*judged.risk_bound, judged.risk_bound_any], 1.0)
    assert [one.union for one in (*found.agents, found.any)] == pytest.approx(expected, rel=1e-9)


def test_the_cap_on_margins_holds_the_first_bound_up() -> None:
    """Beyond the cap an instant still counts g(M') in the paper's bound, and less in the others."""
    game = make_game("parallel", margin_cap=2.0)
    profile = straight(game)
    found = risk_bounds(game, profile).any
    instants = int(evaluate(game, profile).traffic.sum())
    assert found.union == pytest.approx(instants * ndtr(-2 * np.sqrt(2)))
    assert found.faces < 1e-3 * found.union
    assert risk_bounds(replace(game, margin_cap=20.0), profile).any.union == pytest.approx(
        found.faces
    )


def one_agent_and_a_wall(place: float, steps: int, noise: float = 1.0) -> tuple[Game, Profile]:
    """Rides along a wall whose face is so wide that its ends are nowhere near."""
    agent = Agent(
        [0, place], [1.0 * steps, place], Polytope.box([2, 2]), Polytope.box([4, 4]), noise=noise
    )
    wall = Polytope.from_vertices([[-500, 0], [500, 0], [500, -500], [-500, -500]])
    game = Game((agent,), (wall,), horizon=steps)
    return game, make_profile(game, [np.tile([1.0, 0.0], (steps, 1))])


def test_one_agent_and_a_wall_are_sums_of_normal_tails() -> None:
    game, profile = one_agent_and_a_wall(6.0, 6)
    found = risk_bounds(game, profile)
    deviations = np.sqrt(np.arange(1, 6))
    tails = ndtr(-(6.0 - 1.0) / deviations)  # half the body's height reaches down
    assert np.exp(found.log_instants[0, 1:6]) == pytest.approx(tails, rel=1e-9)
    assert np.isneginf(found.log_instants[0, [0, 6]]).all()
    assert found.any.instants == pytest.approx(tails.sum(), rel=1e-9)
    assert found.any.faces == pytest.approx(tails.sum(), rel=1e-9)
    assert found.any.least == pytest.approx(tails.max(), rel=1e-9)


def test_the_forest_takes_off_what_successive_times_share() -> None:
    """A random walk that has crossed a line twice in a row, by the bivariate normal."""
    game, profile = one_agent_and_a_wall(4.0, 3)
    found = risk_bounds(game, profile).any
    shared = multivariate_normal([0, 0], [[1, 1], [1, 2]]).cdf([-3.0, -3.0])
    assert found.instants - found.tree == pytest.approx(shared, rel=1e-4)


def test_what_times_share_follows_the_error_dynamics() -> None:
    """With velocities as states: noise in position and velocity together, and a feedback gain."""
    A, B = double_integrator(2)
    noise = np.kron([[1.0, 0.7], [0.7, 1.0]], np.eye(2))
    gain = np.hstack([0.1 * np.eye(2), 0.3 * np.eye(2)])
    still = Polytope.box([2.0, 2.0])
    agent = Agent([0, 4, 1, 0], [3, 4], still, still, gain=gain, noise=noise, A=A, B=B)
    game = Game((agent,), one_agent_and_a_wall(4.0, 3)[0].obstacles, horizon=3)
    found = risk_bounds(game, make_profile(game, [np.zeros((3, 2))])).any
    # e_1 = w_0 and e_2 = L w_0 + w_1, heights alone
    row = (A - B @ gain)[1]
    between, later = noise[1] @ row, row @ noise @ row + noise[1, 1]
    pair = multivariate_normal([0, 0], [[noise[1, 1], between], [between, later]])
    shared = pair.cdf([-3.0, -3.0])
    assert found.instants - found.tree == pytest.approx(shared, rel=1e-4)


def test_certain_motion_happens_once() -> None:
    """Uncertain start, no noise on the way: all instants of the ride are one event."""
    game, profile = one_agent_and_a_wall(4.0, 8, noise=0.0)
    game = replace(game, agents=(replace(game.agents[0], sigma0=np.eye(2)),))
    found = risk_bounds(game, profile).any
    assert found.instants == pytest.approx(8 * ndtr(-3.0), rel=1e-9)
    assert found.tree == pytest.approx(ndtr(-3.0), rel=2e-3)
    assert found.tree >= found.least == pytest.approx(ndtr(-3.0), rel=1e-9)


def test_two_walls_that_are_hit_together_count_once() -> None:
    """The same obstacle twice: the forest joins encounters of one agent at one time."""
    game, profile = one_agent_and_a_wall(4.0, 5)
    twice = replace(game, obstacles=game.obstacles * 2)
    single, double = risk_bounds(game, profile).any, risk_bounds(twice, profile).any
    assert double.instants == pytest.approx(2 * single.instants)
    assert double.tree == pytest.approx(single.tree, rel=1e-3)


def test_it_is_never_a_silent_zero() -> None:
    game = make_game("parallel", noise=1e-4)
    found = risk_bounds(game, straight(game))
    assert np.isfinite(found.log_instants[0, 1:9]).all()
    assert found.log_instants[0, 1:9].max() < -1e5
    assert (found.instants[0, 1:9] > 0).all()
    assert found.instants[0, 0] == 0
    assert found.any.tree > 0
    assert found.any.union > 0


def test_without_noise_or_encounters_there_is_no_risk() -> None:
    still = make_game("parallel", noise=0.0)
    assert risk_bounds(still, straight(still)).any.faces == 0
    alone = Game((make_game("head_on").agents[0],))
    found = risk_bounds(alone, straight(alone))
    assert found.any == Bounds(0.0, 0.0, 0.0, 0.0, 0.0)
    assert found.encounters == ()


def test_in_space_boxes_and_turned_bodies_are_bounded() -> None:
    game = make_game("intersection_3d", noise=30.0)
    tilted = tuple(replace(agent, shape=Polytope.l1(8.0, 3)) for agent in game.agents)
    for one in (game, replace(game, agents=tilted)):
        profile = straight(one, tuple(3 * k for k in range(len(one.agents))))
        assert_counted(one, profile, 20_000, seed=1)


@examples(0.4)
@given(plays(), st.permutations([0, 1, 2]))
def test_the_order_of_agents_does_not_matter(play: Play, order: list[int]) -> None:
    order = [i for i in order if i < len(play.game.agents)]
    game = replace(play.game, agents=tuple(play.game.agents[i] for i in order))
    swapped = make_profile(game, [play.controls[i] for i in order])
    one, two = risk_bounds(play.game, play.profile), risk_bounds(game, swapped)
    for new, old in enumerate(order):
        for name in ("union", "faces", "instants", "least"):
            expected = getattr(one.agents[old], name)
            assert getattr(two.agents[new], name) == pytest.approx(expected, rel=1e-8)


def test_close_pairs_are_bounded_to_a_few_percent() -> None:
    game = close_pair()
    counted = crash_counts(game, straight(game), 200_000, seed=2).estimates()[1]
    bounds = risk_bounds(game, straight(game)).any
    assert bounds.tree < 1.05 * counted.high
    assert bounds.instants > 1.15 * counted.high
