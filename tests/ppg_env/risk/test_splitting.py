"""Splitting in the environment against plans' exact sampling, plain play, and its own rules."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env import Game, InputError, make_game
from ppg_env.env import episodes as arena
from ppg_env.env.encounter_tables import margin_units
from ppg_env.env.players import GoToGoal, straight_players, track
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator
from ppg_env.game.plan import Profile
from ppg_env.risk import kernel
from ppg_env.risk.batches import generator
from ppg_env.risk.importance_sampling import rare_risk
from ppg_env.risk.splitting import CHAIN, Swarm, find_levels, split_risk
from tests.marks import first
from tests.oracles.plain_monte_carlo import case, fly
from tests.ppg_env.strategies import Play, plays
from tests.profiles import examples

FAR = 4.0


def as_planned(profile: Profile) -> Rules:
    """The rules under which the environment plays plans as the planners count."""
    schedule = tuple(10_000 if plan.arrival is None else plan.arrival for plan in profile)
    return Rules(arrival="schedule", schedule=schedule, saturation="none", on_crash="continue")


def swarm(game: Game, shape: tuple[int, int], seed: int = 0, rules: Rules | None = None) -> Swarm:
    players = [GoToGoal(game, i) for i in range(len(game.agents))]
    return Swarm(game, players, rules, shape, generator(seed), lambda _count: None)


@pytest.mark.parametrize("name", first(1, ["corner 1e-4", "side 1e-5", "crowd 1e-4"]))
def test_tracked_plans_crash_as_often_as_sampling_the_plans_says(name: str) -> None:
    game, profile = case(name)
    exact = rare_risk(game, profile, 50_000)
    found = split_risk(game, track(game, profile), 1000, seed=1, rules=as_planned(profile))
    assert found.any.standard_error < 0.15 * found.any.value
    for one, truth in zip([*found.agents, found.any], [*exact.agents, exact.any], strict=True):
        if one.trusted or one is found.any:
            assert abs(one.value - truth.value) <= FAR * one.standard_error
        else:
            assert truth.value <= one.high
    for one, truth in zip(found.encounters, exact.encounters, strict=True):
        assert truth.value <= one.high + FAR * one.standard_error


@pytest.mark.slow
def test_far_below_what_can_be_counted_it_still_agrees() -> None:
    game = make_game("parallel", start={1: [10.0, 43.0]}, goal={1: [95.0, 43.0]}, noise=1.3)
    profile = fly(game)
    exact = rare_risk(game, profile, 20_000).any
    assert exact.value < 1e-8
    found = split_risk(game, track(game, profile), 1000, seed=2, rules=as_planned(profile)).any
    assert abs(found.value - exact.value) <= FAR * found.standard_error
    assert found.standard_error < 0.2 * found.value


@pytest.mark.slow
def test_repetitions_are_unbiased_and_their_spread_is_honest() -> None:
    """Many runs with few states: their mean is the truth, and so is the mean of their errors."""
    game, profile = case("side 1e-3")
    exact = rare_risk(game, profile, 50_000).any.value
    rules, players = as_planned(profile), track(game, profile)
    runs = [split_risk(game, players, 100, seed, rules=rules).any for seed in range(1000, 1030)]
    values = np.array([run.value for run in runs])
    assert abs(values.mean() - exact) <= FAR * values.std(ddof=1) / np.sqrt(len(runs))
    errors = np.sqrt(np.mean([run.standard_error**2 for run in runs]))
    assert errors == pytest.approx(values.std(ddof=1), rel=0.4)
    assert sum(run.low <= exact <= run.high for run in runs) >= 25


@pytest.mark.parametrize("on_goal", ["remove", "stay"])
@pytest.mark.parametrize("on_crash", first(1, ["remove", "continue"]))
def test_under_the_environments_rules_it_agrees_with_plain_play(
    on_goal: str, on_crash: str
) -> None:
    lane = make_game("parallel", noise=3.0).agents[0]
    places = [([10, 70], [95, 70]), ([10, 50], [95, 50]), ([10, 30], [50, 30])]
    game = Game(tuple(replace(lane, start=start, goal=goal) for start, goal in places))
    rules = Rules(on_goal=on_goal, on_crash=on_crash)
    players = straight_players(game)
    plain = arena.evaluate(game, players, 20_000, 3, rules=rules).summary(1 - 1e-4)
    found = split_risk(game, players, 300, seed=4, rules=rules)
    for one, counted in zip(
        [*found.agents, found.any], [*plain.crash, plain.crash_any], strict=True
    ):
        assert counted.low - FAR * one.standard_error <= one.value
        assert one.value <= counted.high + FAR * one.standard_error


def test_the_seed_fixes_it_and_progress_adds_up() -> None:
    game, profile = case("side 1e-3")
    seen: list[int] = []
    request = (game, track(game, profile), 95)
    one = split_risk(*request, seed=5, progress=seen.append)
    assert sum(seen) == one.samples
    assert split_risk(*request, seed=5) == one
    assert split_risk(*request, seed=6).any != one.any


def test_without_noise_no_way_to_a_crash_is_found_and_that_is_said() -> None:
    game = make_game("parallel", noise=0.0)
    found = split_risk(game, straight_players(game), 20)
    assert (found.any.value, found.any.trusted) == (0.0, False)
    assert found.any.high > 0
    assert "no way to a crash" in found.any.advice


def test_players_that_always_crash_need_no_level() -> None:
    game = make_game("head_on", noise=0.01)
    found = split_risk(game, straight_players(game), 20)
    assert found.any.value == 1.0


@pytest.mark.parametrize(
    "wrong", [{"states": 0}, {"seed": -1}, {"repetitions": 1}, {"players": []}]
)
def test_bad_requests_are_refused(wrong: dict) -> None:
    game = make_game("parallel")
    with pytest.raises(InputError):
        split_risk(**({"game": game, "players": straight_players(game)} | wrong))


def test_moves_leave_the_noise_normal_where_every_state_is_allowed() -> None:
    crowd = swarm(make_game("parallel", noise=1.0), (2, 40 * CHAIN))
    for _ in range(3):
        crowd.move(np.inf, 0.5)
    flat = crowd.noise.ravel()
    assert abs(flat.mean()) < 0.05
    assert flat.std() == pytest.approx(1.0, abs=0.03)


def test_after_a_move_every_state_is_below_the_level_and_belongs_to_its_noise() -> None:
    game = make_game("parallel", noise=6.0)
    crowd = swarm(game, (3, 20 * CHAIN))
    level = float(np.quantile(crowd.score, 0.2, method="lower"))
    crowd.move(level, 0.6)
    assert (crowd.score <= level).all()
    again = crowd._simulate(crowd.noise[:, : crowd._batch[1]])
    np.testing.assert_array_equal(again[1], crowd.score[:, : crowd._batch[1]])
    np.testing.assert_array_equal(again[2], crowd.events[:, : crowd._batch[1]])
    assert len(np.unique(crowd.noise[..., 1, 0, 0])) > crowd.score.size / 4


def test_levels_fall_towards_a_crash() -> None:
    game, profile = case("side 1e-5")
    pilot = Swarm(
        game, track(game, profile), as_planned(profile), (2, 500), generator(0), lambda _count: None
    )
    levels = find_levels(pilot)
    assert levels is not None
    scores = [level.score for level in levels]
    assert scores == sorted(scores, reverse=True)
    assert len(scores) in range(3, 8)
    assert scores[-1] >= 0
    assert all(0 < level.size <= 1 for level in levels)


@examples(0.6)
@given(plays(scale="exact"), st.sampled_from(["remove", "stay"]), st.integers(0, 50))
def test_the_score_is_the_smallest_margin_of_who_might_collide(
    play: Play, on_goal: str, seed: int
) -> None:
    """Against margins recomputed in NumPy, one encounter and copy at a time."""
    game, stay = play.game, on_goal == "stay"
    simulator = Simulator(game, Rules(on_goal=on_goal, tolerance=0.0), 8, seed)
    simulator.reset()
    tables, closest = simulator.tables, np.full(8, np.inf)
    table = margin_units(game)[0]
    expected, random = np.full(8, np.inf), np.random.default_rng(seed)
    for _ in range(3):
        simulator.step(random.uniform(-16, 16, (8, len(game.agents), 2)), restart=False)
        kernel.approach(
            tables.axes, simulator.state, simulator.status, simulator.clock, tables.stay,
            tables.pair, tables.normals, tables.offsets, table, closest,
        )  # fmt: skip
        for c in range(8):
            row = min(simulator.clock[c], game.horizon)
            for e, encounter in enumerate(game.encounters):
                where = [simulator.state[c, i, :2] for i in encounter.agents]
                stands = sorted(int(simulator.status[c, i]) for i in encounter.agents)
                meet = stands in ([0], [0, 0]) or (stay and stands == [0, 1])
                if meet:
                    units = table[row, slice(*tables.pair[e, 2:])]
                    faces = encounter.collision
                    gaps = faces.normals @ encounter.displacement(*where) - faces.offsets
                    expected[c] = min(expected[c], (gaps / units).max())
    np.testing.assert_allclose(closest, expected, atol=1e-9)
