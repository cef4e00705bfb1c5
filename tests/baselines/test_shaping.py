"""Shaped and scaled rewards, the same in all views of many copies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baselines.shaping import RewardShaping, straight_pace
from ppg_env import InputError, Simulator, make_game
from ppg_env.env import Randomize, Rules, Uniform

ROUGH: dict[str, Any] = {"tolerance": 25.0, "max_cycles": 14}
"""With strong noise some agents arrive early, some crash and some run out of time."""

SCALE = 20.0


def rough(scenario: str) -> Any:
    return make_game(scenario, noise=200.0)


@pytest.mark.parametrize("scenario", ["head_on", "intersection3", "corridor"])
def test_arrivals_and_crashes_change_by_a_constant_and_time_limits_by_what_is_left(
    scenario: str,
) -> None:
    game = rough(scenario)
    simulator = Simulator(game, Rules(**ROUGH), 200, seed=0)
    shaping, rng = RewardShaping(simulator, True, SCALE), np.random.default_rng(0)
    pace = straight_pace(game, simulator.tables.scale)
    first = simulator.reset().copy()
    total, plain, last = np.zeros((3, 200, len(game.agents)))
    n, d = simulator.state.shape[2], game.dim
    late = np.zeros(total.shape, dtype=bool)
    while simulator.alive.any():
        alive = simulator.alive.copy()
        shaping.before_step()
        action = rng.uniform(simulator.low, simulator.high, (200, *simulator.low.shape))
        out = simulator.step(action, restart=False)
        paid = shaping.rewards(out.observation)
        total, plain = total + alive * paid, plain + alive * out.reward
        late |= out.truncated
        left = np.linalg.norm(out.observation[..., :d], axis=2) * out.observation[..., n + d]
        last = np.where(alive, left, last)
    lam = np.array([agent.lam for agent in game.agents])
    constant = lam * pace * np.linalg.norm(first[..., :d], axis=2)
    change = SCALE * total - plain
    assert late.any()
    assert not late.all()
    np.testing.assert_allclose(change[~late], constant[~late], atol=1e-4)
    np.testing.assert_allclose(change[late], (constant - lam * pace * last)[late], atol=1e-4)
    assert (lam * pace * last)[late].min() > 0


def test_agents_that_share_get_the_changes_of_all() -> None:
    rng, paid = np.random.default_rng(0), {}
    for sharing in ("selfish", "social"):
        simulator = Simulator(rough("intersection3"), Rules(sharing=sharing, **ROUGH), 5, seed=0)
        shaping = RewardShaping(simulator, True, 1.0)
        simulator.reset()
        shaping.before_step()
        rng = np.random.default_rng(0)
        action = rng.uniform(simulator.low, simulator.high, (5, *simulator.low.shape))
        paid[sharing] = shaping.rewards(simulator.step(action, restart=False).observation)
    each = paid["selfish"].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(paid["social"], np.broadcast_to(each, (5, 3)), atol=1e-9)


def test_the_lam_of_the_episode_counts_although_the_copy_restarts() -> None:
    """A copy that restarts draws another lam in the same step."""
    rule = Randomize(lam=Uniform(0.1, 0.9))
    restarted, kept = (
        Simulator(rough("head_on"), Rules(**ROUGH), 100, seed=0, randomize=rule) for _ in range(2)
    )
    shaping, wanted = (RewardShaping(s, True, 1.0) for s in (restarted, kept))
    restarted.reset(), kept.reset()
    action = np.zeros((100, *kept.low.shape))
    for _ in range(ROUGH["max_cycles"]):
        shaping.before_step(), wanted.before_step()
        out, plain = restarted.step(action), kept.step(action, restart=False)
        final = np.where(out.over[:, None, None], out.final_observation, out.observation)
        assert np.array_equal(shaping.rewards(final), wanted.rewards(plain.observation))
        kept.reset(plain.over) if plain.over.any() else None
    assert out.over.any()


def test_without_shaping_rewards_are_divided_only() -> None:
    simulator = Simulator(rough("head_on"), Rules(**ROUGH), 3, seed=0)
    shaping = RewardShaping(simulator, False, SCALE)
    simulator.reset()
    shaping.before_step()
    out = simulator.step(np.zeros((3, 2, 2)), restart=False)
    assert np.array_equal(shaping.rewards(out.observation), out.reward / SCALE)


@pytest.mark.parametrize(
    ("shaping", "scale", "sentence"),
    [
        ("x", 1.0, "^shaping: is 'x'; write True or False"),
        (True, 0.0, r"^reward_scale: is 0\.0; give a positive number"),
        (True, "a", "^reward_scale: is 'a', not a finite number; give a positive number"),
    ],
)
def test_other_values_are_refused(shaping: Any, scale: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        RewardShaping(Simulator(make_game("head_on")), shaping, scale)
