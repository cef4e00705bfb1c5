"""The PettingZoo environment with shaped rewards."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test

from baselines import ShapedEnv
from baselines.shaping import straight_pace
from ppg_env import InputError, parallel_env
from ppg_env.env import Choice, Randomize


@pytest.mark.parametrize("scenario", ["head_on", "intersection3", "circle(4)", "corridor"])
@pytest.mark.parametrize("together", [False, True])
def test_returns_change_by_the_potential_at_the_end_minus_that_at_the_start(
    scenario: str, together: bool
) -> None:
    shaped, plain = ShapedEnv(scenario, together=together), parallel_env(scenario)
    rng, names = np.random.default_rng(0), plain.possible_agents
    pace = straight_pace(plain.game, plain.simulator.tables.scale)
    d, n = plain.game.dim, plain.simulator.state.shape[2]
    for seed in range(5):
        first, last = shaped.reset(seed=seed)[0], plain.reset(seed=seed)[0]
        returns, expected = dict.fromkeys(names, 0.0), dict.fromkeys(names, 0.0)
        while plain.agents:
            moves = {name: rng.uniform(-1, 1, 2) for name in names}
            boxes = {name: plain.action_space(name) for name in names}
            seen, rewards, *_ = shaped.step({name: moves[name] for name in shaped.agents})
            inputs = {
                name: (box.high + box.low) / 2 + (box.high - box.low) / 2 * moves[name]
                for name, box in boxes.items()
            }
            observed, plain_rewards, *_ = plain.step(inputs)
            last |= observed
            assert all(np.array_equal(seen[name], last[name]) for name in seen)
            for total, new in ((returns, rewards), (expected, plain_rewards)):
                total |= {name: total[name] + new[name] for name in new}
        assert shaped.agents == []
        for name, agent, rate in zip(names, plain.game.agents, pace, strict=True):
            start, end = (
                -agent.lam * rate * np.linalg.norm(ends[name][:d]) * ends[name][n + d]
                for ends in (first, last)
            )
            assert 20.0 * returns[name] == pytest.approx(expected[name] + end - start, abs=1e-4)


@pytest.mark.parametrize("together", [False, True])
def test_it_passes_the_official_test(together: bool) -> None:
    parallel_api_test(ShapedEnv("intersection3", together=together), num_cycles=60)


@pytest.mark.parametrize("action", [np.zeros(1), np.zeros(3), np.zeros((1, 2)), ["a", "b"]])
def test_actions_of_another_shape_are_refused(action: Any) -> None:
    env = ShapedEnv("head_on")
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"^actions\['agent_1'\]: is .*, not 2 finite numbers"):
        env.step({"agent_0": np.zeros(2), "agent_1": action})


def test_a_step_before_the_reset_and_options_of_no_use_are_refused() -> None:
    with pytest.raises(InputError, match=r"^step: comes before the first reset"):
        ShapedEnv("head_on").step({})
    with pytest.raises(InputError, match=r"^reward_scale: is 0"):
        ShapedEnv("head_on", reward_scale=0)
    with pytest.raises(InputError, match=r"^reward_scal: is not an option; .*reward_scale"):
        ShapedEnv("head_on", reward_scal=20.0)


def test_after_the_end_a_step_returns_nothing() -> None:
    env = ShapedEnv("head_on", together=True, max_cycles=1)
    env.reset(seed=0)
    env.step({name: np.zeros(2) for name in env.agents})
    assert env.step({}) == ({}, {}, {}, {}, {})


def test_agents_that_play_together_end_together() -> None:
    env = ShapedEnv("intersection3", together=True, noise=0.0)
    env.reset(seed=0)
    done: dict[str, Any] = {}
    while env.agents:
        assert env.agents == env.possible_agents
        seen, _, terminated, truncated, infos = env.step(
            {name: np.full(2, 0.3, dtype=np.float32) for name in env.agents}
        )
        done = {name: terminated[name] or truncated[name] for name in terminated}
        assert len(set(done.values())) == 1
        assert list(seen) == list(infos) == env.possible_agents
    assert all(done.values())


def test_agents_that_are_missing_do_not_play_together() -> None:
    env = ShapedEnv("circle(4)", together=True, randomize=Randomize(agents=Choice([2])))
    env.reset(seed=0)
    present = env.agents
    assert len(present) == 2
    while env.agents:
        assert env.agents == present
        rewards = env.step({name: np.zeros(2) for name in present})[1]
        assert list(rewards) == present
