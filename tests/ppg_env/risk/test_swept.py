"""Crashes between the instants, and two counts of the same episodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env import Agent, Game, InputError, Polytope, make_game, make_profile
from ppg_env.game.plan import Profile
from ppg_env.risk.batches import BLOCK, generator
from ppg_env.risk.crash_events import make_crash_model
from ppg_env.risk.importance_sampling import rare_risk
from ppg_env.risk.monte_carlo import crash_counts, paired_counts
from tests.oracles.plain_monte_carlo import case, fly
from tests.ppg_env.strategies import Play, plays


def thin_wall(noise: float = 0.01) -> tuple[Game, Profile]:
    """An agent of width 2 that steps over a wall of width 1, from 5 before it to 5 behind it."""
    wall = Polytope.from_vertices([[4.5, -50], [5.5, -50], [5.5, 50], [4.5, 50]])
    agent = Agent([0, 0], [20, 0], Polytope.box([2, 2]), Polytope.box([20, 20]), 0.5, 0.5, noise)
    game = Game((agent,), (wall,), horizon=3)
    return game, fly(game)


def test_who_passes_through_a_wall_within_a_step_is_seen_only_when_steps_are_watched() -> None:
    flown = thin_wall()
    counts = paired_counts(flown, flown, 500, swept=(False, True))
    assert counts.first.any == 0
    assert counts.second.any == 500
    assert counts.second.times[0].tolist() == [0, 500, 0, 0]
    assert counts.only_second.tolist() == [500, 500]
    assert rare_risk(*flown, 500).any.value < 1e-12
    assert rare_risk(*flown, 500, swept=True).any.value == pytest.approx(1.0)


def test_the_last_step_counts_up_to_the_arrival_but_not_the_arrival_itself() -> None:
    # The wall stands between the last instant in traffic and the goal.
    wall = Polytope.from_vertices([[14.5, -50], [15.5, -50], [15.5, 50], [14.5, 50]])
    game = replace(thin_wall()[0], obstacles=(wall,))
    profile = fly(game)
    assert profile[0].arrival == 2
    counts = crash_counts(game, profile, 500, swept=True)
    assert counts.times[0].tolist() == [0, 0, 500, 0]
    beyond = replace(game, obstacles=(Polytope.from_vertices(wall.vertices + np.array([7.5, 0])),))
    assert crash_counts(beyond, profile, 500, swept=True).any == 0


def test_an_agent_that_never_arrives_is_watched_up_to_the_horizon() -> None:
    game, _ = thin_wall()
    away = make_profile(game, [np.array([[-3.0, 0.0], [-3.0, 0.0], [9.0, 0.0]])])
    assert away[0].arrival is None
    assert crash_counts(game, away, 300, swept=True).times[0].tolist() == [0, 0, 0, 0]
    back = make_profile(game, [np.array([[-3.0, 0.0], [-3.0, 0.0], [19.0, 0.0]])])
    assert crash_counts(game, back, 300, swept=True).times[0].tolist() == [0, 0, 0, 300]


@given(plays(scale="exact"), st.integers(0, 100))
def test_watching_steps_sees_what_many_points_between_the_instants_see(
    play: Play, seed: int
) -> None:
    game, profile = play.game, play.profile
    model = make_crash_model(game, profile, swept=True)
    errors = model.processes.draw(generator(seed), model.processes.scratch(model.steps)(), True)
    met = model.watch(errors, BLOCK).met
    share = np.linspace(0, 1, 41)[:-1, None, None]  # the end of the last step is not in traffic
    for e, (first, second) in enumerate(model.processes.parties):
        other = errors[:, second] if second >= 0 else 0.0
        where = (errors[:, first] - other)[:, : game.dim].transpose(0, 2, 1)
        where = where + model.nominal[e, : model.steps + 1, None]  # (T+1, B, d)
        seen = np.zeros(BLOCK, dtype=bool)
        near = np.zeros(BLOCK, dtype=bool)
        normals, depths = model.faces(e)
        for t in range(min(model.until[e], model.steps)):
            points = (1 - share) * where[t] + share * where[t + 1]
            beyond = (points @ normals.T - depths).max(axis=-1)  # (points, B)
            reach = np.abs((where[t + 1] - where[t]) @ normals.T).max(axis=-1) / 40
            seen |= (beyond <= 0).any(axis=0)
            near |= (beyond <= reach).any(axis=0)
        assert (met[e] >= seen).all()
        assert (met[e] <= near).all()


@given(plays(scale="exact"), st.integers(0, 100))
def test_watching_steps_misses_nothing_that_instants_show(play: Play, seed: int) -> None:
    flown = (play.game, play.profile)
    counts = paired_counts(flown, flown, 1500, seed, swept=(False, True))
    assert not counts.only_first.any()
    added = counts.second.agents - counts.first.agents
    assert counts.only_second.tolist() == [*added, counts.second.any - counts.first.any]


def test_two_counts_of_the_same_episodes_are_those_of_either_alone() -> None:
    flown, workers = case("crowd 1e-3"), (1, 2)
    samples = 40 * BLOCK + 10
    one, two = (
        paired_counts(flown, flown, samples, 5, swept=(False, True), workers=w) for w in workers
    )
    for way, swept in (("first", False), ("second", True)):
        alone = crash_counts(*flown, samples, 5, swept=swept)
        for counts in (one, two):
            paired = getattr(counts, way)
            assert (paired.times == alone.times).all()
            assert (paired.agents == alone.agents).all()
            assert (paired.first_any == alone.first_any).all()


def test_a_plan_compared_with_itself_differs_in_no_episode() -> None:
    game, profile = case("side 1e-3")
    counts = paired_counts((game, profile), (game, profile), 50_000)
    assert counts.first.any > 10
    assert not counts.only_first.any()
    assert not counts.only_second.any()
    each, any_agent = counts.differences()
    for found in (*each, any_agent):
        assert found.low < 0 == found.value < found.high < 1e-4


def test_common_noise_tells_near_plans_apart_sooner() -> None:
    game = make_game("parallel", start={1: [10.0, 47.0]}, goal={1: [95.0, 47.0]}, noise=3.0)
    wider = replace(
        game,
        agents=(game.agents[0], replace(game.agents[1], start=[10.0, 46.5], goal=[95.0, 46.5])),
    )
    near, far = (game, fly(game)), (wider, fly(wider))
    counts = paired_counts(near, far, 100_000, 2)
    _, found = counts.differences()
    _, sure = counts.differences(1 - 1e-4)
    truth = rare_risk(*far).any.value - rare_risk(*near).any.value
    assert sure.low < truth < sure.high < 0
    apart = [crash_counts(*flown, 100_000, s).estimates()[1] for s, flown in enumerate((near, far))]
    alone = np.hypot(apart[0].high - apart[0].low, apart[1].high - apart[1].low)
    assert found.high - found.low < 0.6 * alone


def test_plans_of_games_with_other_feedback_meet_the_same_normals() -> None:
    game = make_game("parallel", start={1: [10.0, 47.0]}, goal={1: [95.0, 47.0]}, noise=3.0)
    same = replace(game, agents=tuple(replace(agent) for agent in game.agents))
    loose = replace(game, agents=tuple(replace(agent, gain=0.3) for agent in game.agents))
    flown = (game, fly(game))
    copy = paired_counts(flown, (same, fly(same)), 30_000)
    assert copy.first.any > 100
    assert not copy.only_second.any()
    counts = paired_counts(flown, (loose, fly(loose)), 30_000)
    assert counts.differences()[1].low > 0
    assert counts.only_first[-1] < counts.first.any / 2


def test_plans_for_other_agents_are_not_compared() -> None:
    with pytest.raises(InputError, match="same agents"):
        paired_counts(case("side 1e-3"), case("crowd 1e-3"), 10)
